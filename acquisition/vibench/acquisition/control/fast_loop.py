"""The law of a fast loop for a rig, and what its coefficients mean: volts there, motions here."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import NDArray

from vibench.sim import ArcEnd, RigidStops
from vibench.sim.feedback.branch import Begin, branch_hold
from vibench.sim.feedback.law import LinearLaw, designed_law, pd_law
from vibench.sim.feedback.loop import loop_transfer
from vibench.sim.feedback.plant import LoopTiming, SampledPlant

from ..errors import ConfigurationError, LimitExceeded
from ..excitation.branch_continuation import BranchContinuation
from ..instruments import LoopBlock, LoopFeedback, LoopInput
from ..plan import Measurement
from ..rig import ControllerConfig, Rig, amplifier_of, shaker_of, specimen_of

Coefficients = NDArray[np.complex128]
LARGEST_MULTIPLIER = 0.99
"""Of the loop along a branch that is allowed: a departure falls to a third in a hundred periods."""


@dataclass(frozen=True, eq=False)
class FastLoop:
    """The plant of a rig as its configuration describes it, and the law that was designed from it."""

    rig: Rig
    plant: SampledPlant
    law: LinearLaw

    @property
    def rate_hz(self) -> float:
        """Samples a second."""
        return self.plant.timing.rate_hz

    @property
    def feedback(self) -> LoopFeedback:
        """The law as a controller takes it: of volts."""
        units = np.array(_units_per_volt(self.rig))
        return LoopFeedback(
            step=_rows(self.law.step),
            inlet=_rows(self.law.inlet * units),
            output=_rows(self.law.output)[0],
            direct=_rows(self.law.direct * units)[0],
        )

    def gains(self, frequency_hz: float, harmonics: int) -> Coefficients:
        """Give base displacement over volts at each harmonic, by the model [m/V], shape (harmonics,)."""
        orders = range(1, harmonics + 1)
        return np.array([loop_transfer(self.plant, self.law, k * frequency_hz) for k in orders])

    def motions(self, blocks: Sequence[LoopBlock], frequency_hz: float) -> tuple[Coefficients, Coefficients]:
        """Displacements of base and m0 in each block, from the first harmonic on [m], shape (blocks, orders).

        A sample is the mean since the one before: half a step late, and a little small.
        """
        orders = np.arange(1, len(blocks[0].base))
        turning = 2j * pi * frequency_hz * orders
        late = np.exp(0.5 * turning / self.rate_hz) / np.sinc(frequency_hz * orders / self.rate_hz)
        per_base, per_m0 = _units_per_volt(self.rig)
        base = np.array([[complex(*pair) for pair in block.base[1:]] for block in blocks])
        m0 = np.array([[complex(*pair) for pair in block.m0[1:]] for block in blocks])
        delay = np.exp(turning * self.rig.vibrometer.delay_s)
        return per_base * base * late / turning**2, per_m0 * m0 * late * delay / turning


def fast_loop(rig: Rig) -> FastLoop:
    """Design the law of a rig's controller; raises ConfigurationError where it has none."""
    controller = controller_of(rig)
    timing = LoopTiming(controller.rate_hz, controller.latency_s)
    plant = SampledPlant(amplifier_of(rig), shaker_of(rig), specimen_of(rig), timing)
    sample = None if controller.pd_of is None else list(LoopInput).index(controller.pd_of)
    return FastLoop(rig, plant, designed_law(plant) if sample is None else pd_law(plant, sample))


def require_holdable(measurement: Measurement, rig: Rig) -> None:
    """Refuse a measurement whose motions the rig's fast loop does not hold, see `require_held`."""
    match measurement.excitation:
        case BranchContinuation() as plan:
            require_held(fast_loop(rig), plan)


def require_held(fast: FastLoop, plan: BranchContinuation) -> None:
    """Refuse a branch that the loop does not hold, by the model.

    Raises
    ------
    LimitExceeded
        With the largest multiplier of the loop and how far it would hold, or with why that is not known.
        Nothing was played.

    """
    level_m, timing = level_at(plan, plan.start_hz), fast.plant.timing
    unknown = "whether the fast loop holds the branch is not known: "
    if isinstance(fast.plant.specimen.contact, RigidStops):
        raise LimitExceeded(
            f"{unknown}rigid stops push with no finite force. Nothing was played; give the specimen of "
            "the hardware configuration another contact law, such as hertz"
        )
    hold = branch_hold(
        fast.plant,
        fast.law,
        level_m,
        plan.start_hz,
        plan.band_hz,
        Begin(plan.begin_from),
        plan.begin,
        LARGEST_MULTIPLIER,
    )
    if hold is None:
        raise LimitExceeded(
            f"{unknown}the model finds no motion that repeats every period at start_hz = {plan.start_hz:g} "
            f"under {level_m:.3g} m. Nothing was played; begin at another frequency, level, or begin_from"
        )
    held = "not even its first motion"
    if hold.held_hz is not None:
        behind = f", behind {hold.folds} fold{'s' * (hold.folds > 1)}" if hold.folds else ""
        held = f"it from {plan.start_hz:.5g} to {hold.held_hz:.5g} Hz{behind}"
    if hold.multiplier > LARGEST_MULTIPLIER:
        raise LimitExceeded(
            f"the fast loop would not hold the branch: by the model its largest multiplier is "
            f"{hold.multiplier:.3g} at {hold.at_hz:.5g} Hz with {1e3 * timing.latency_s:.3g} ms of latency "
            f"at {timing.rate_hz:g} samples a second, allowed is at most {LARGEST_MULTIPLIER:g}; it would "
            f"hold {held}. Nothing was played; narrow the range, shorten the latency, or lower the level"
        )
    if hold.end not in (ArcEnd.REACHED_BOUND, ArcEnd.CLOSED):
        raise LimitExceeded(
            f"{unknown}the model follows {held} only ({hold.end}). Nothing was played; narrow the range, or "
            "change the level"
        )


def level_at(plan: BranchContinuation, frequency_hz: float) -> float:
    """Give the amplitude of the base's displacement that is held [m]."""
    return plan.base_level.acceleration_at(frequency_hz) / (2 * pi * frequency_hz) ** 2


def controller_of(rig: Rig) -> ControllerConfig:
    """Give a rig's controller; raises ConfigurationError where it has none."""
    match rig.controller:
        case ControllerConfig():
            return rig.controller
        case _:
            raise ConfigurationError(
                "a branch is followed by a real-time controller, and this bench has none. Nothing was "
                "played; add [controller] to the hardware configuration"
            )


def _units_per_volt(rig: Rig) -> tuple[float, float]:
    """Give base acceleration and m0 velocity per volt of their sensors [m/s2 per V, m/s per V]."""
    return 1 / rig.accelerometer.sensitivity_v_per_m_per_s2, rig.vibrometer.range_mm_per_s_per_v * 1e-3


def _rows(table: NDArray[np.float64]) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(map(float, row)) for row in table)
