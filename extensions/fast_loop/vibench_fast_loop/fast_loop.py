"""The law of a fast loop for a rig, what its coefficients mean, and how it holds a branch by the model."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import ceil, pi
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from vibench.acquisition.errors import ConfigurationError, LimitExceeded
from vibench.acquisition.rig import LoopInput, Rig, amplifier_of, shaker_of, specimen_of
from vibench.sim import (
    ArcEnd,
    BifurcationKind,
    Branch,
    FrequencyPath,
    Harmonic,
    RigidStops,
    ShootingEnd,
    Specimen,
    periodic_branch_within,
    periodic_orbit,
)
from vibench.sim.periodic.balance_branch import balance, balance_branch_within
from vibench.sim.periodic.harmonic_balance import BalanceEnd, structure_of
from vibench.sim.periodic.restoring_force import spring_of
from vibench.sim.periodic.shooting import PeriodMap
from vibench.sim.specimen.state import VY, VZ, Floats, Y, Z

from .branch_continuation import BranchContinuation
from .law import LinearLaw, design_law, loop_multiplier, loop_transfer, pd_law
from .plant import LoopTiming, SampledPlant
from .protocol import LoopBlock, LoopFeedback

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
        """Return base displacement over volts at each harmonic, by the model [m/V], shape (harmonics,)."""
        orders = range(1, harmonics + 1)
        return np.array([loop_transfer(self.plant, self.law, k * frequency_hz) for k in orders])

    def motions(self, blocks: Sequence[LoopBlock], frequency_hz: float) -> tuple[Coefficients, Coefficients]:
        """Displacements of base and m0 in each block, from the first harmonic on [m], shape (blocks, orders).

        A sample is the mean since the one before: half a step late, and a little small.
        """
        orders, rate_hz = np.arange(1, len(blocks[0].base)), self.plant.timing.rate_hz
        turning = 2j * pi * frequency_hz * orders
        late = np.exp(0.5 * turning / rate_hz) / np.sinc(frequency_hz * orders / rate_hz)
        per_base, per_m0 = _units_per_volt(self.rig)
        base = np.array([[complex(*pair) for pair in block.base[1:]] for block in blocks])
        m0 = np.array([[complex(*pair) for pair in block.m0[1:]] for block in blocks])
        delay = np.exp(turning * self.rig.vibrometer.delay_s)
        return per_base * base * late / turning**2, per_m0 * m0 * late * delay / turning


def fast_loop(rig: Rig) -> FastLoop:
    """Design the law of a rig's controller; raises ConfigurationError where it has none."""
    controller = rig.controller
    if controller is None:
        raise ConfigurationError(
            "a branch is followed by a real-time controller, and this bench has none. Nothing was played; "
            "add [controller] to the hardware configuration"
        )
    timing = LoopTiming(controller.rate_hz, controller.latency_s)
    plant = SampledPlant(amplifier_of(rig), shaker_of(rig), specimen_of(rig), timing)
    sample = None if controller.pd_of is None else list(LoopInput).index(controller.pd_of)
    return FastLoop(rig, plant, design_law(plant) if sample is None else pd_law(plant, sample))


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
        plan.begin_from,
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
    """Return the amplitude of the base's displacement that is held [m]."""
    return plan.base_level.acceleration_at(frequency_hz) / (2 * pi * frequency_hz) ** 2


def _units_per_volt(rig: Rig) -> tuple[float, float]:
    """Return base acceleration and m0 velocity per volt of their sensors [m/s2 per V, m/s per V]."""
    return 1 / rig.accelerometer.sensitivity_v_per_m_per_s2, rig.vibrometer.range_mm_per_s_per_v * 1e-3


def _rows(table: NDArray[np.float64]) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(map(float, row)) for row in table)


Points = NDArray[np.int64]
Begin = Literal["rest", "above"]
_POINTS = 25
"""Motions of a branch that are looked at, stable ones too: a late law may lose what needs none."""
_PERIODS, _WHOLE = range(1, 41), 2e-5
"""Of a motion that are gone through: as few as take a whole number of samples within this part of it."""
_WAVE, _WAVE_OF_STOPS = 512, 8192
"""Samples of a period by which the slope of the spring is known along it."""
_PART_S = 1e-6
"""Part of a sample for which the slope of stops is taken: a contact lasts a hundred of them."""
_FROM_ABOVE = (3.0, 2.5, 2.0, 1.7, 1.4, 1.2, 1.0)
"""Levels, over the one that is asked for, along which motions among stops are led down to it."""


@dataclass(frozen=True)
class BranchHold:
    """What a law makes of the motions of a branch, from its start on."""

    multiplier: float
    """The largest over a period with the law acting."""
    at_hz: float
    """Where that is [Hz]."""
    held_hz: float | None
    """Up to where every motion is held; None where not even the first is [Hz]."""
    folds: int
    """That lie before."""
    end: ArcEnd | None
    """Why the model left the branch."""


def branch_hold(
    plant: SampledPlant,
    law: LinearLaw,
    level_m: float,
    start_hz: float,
    range_hz: tuple[float, float],
    begin: Begin = "rest",
    way: Literal["up", "down"] = "up",
    allowed: float = 1.0,
) -> BranchHold | None:
    """Follow the model's branch under one level of the base, and see how a law holds it.

    Parameters
    ----------
    plant, law
        As the host knows them; of a specimen without rigid stops.
    level_m
        Amplitude of the base's displacement [m].
    start_hz, range_hz
        Where the branch begins, and where it is left [Hz].
    begin
        From which side the level is met there: from rest, or from three times the level, which is where
        motions with impacts are found; where there are no stops, from rest.
    way
        Which way the branch is started.
    allowed
        Multiplier up to which a motion counts as held.

    Returns
    -------
    None where the model has no motion to begin with.
    """
    spring = spring_of(plant.specimen)
    if spring.kinks:
        branch = impact_branch(plant.specimen, level_m, start_hz, range_hz, begin)
    else:
        structure = structure_of(plant.specimen)
        first = balance(structure, spring, start_hz, level_m)
        if first.outcome is BalanceEnd.NO_SOLUTION:
            return None
        branch = balance_branch_within(structure, spring, first, FrequencyPath((level_m,)), *range_hz)
    if branch is None:
        return None
    start = int(np.argmin(np.abs(branch.frequencies_hz - start_hz)))
    ahead = np.arange(start, len(branch.frequencies_hz)) if way == "up" else np.arange(start, -1, -1)
    points = ahead[np.unique(np.linspace(0, ahead.size - 1, _POINTS).astype(int))]
    held = branch_multipliers(plant, law, branch, points)
    worst = int(np.argmax(held))
    last = _last_held(plant, law, branch, points, held, allowed)
    low, high = sorted((start, start if last is None else last))
    return BranchHold(
        multiplier=float(held[worst]),
        at_hz=float(branch.frequencies_hz[points[worst]]),
        held_hz=None if last is None else float(branch.frequencies_hz[last]),
        folds=sum(each.kind is BifurcationKind.FOLD and low <= each.index < high for each in branch.events),
        end=branch.end if way == "up" else branch.begin,
    )


def impact_branch(
    specimen: Specimen,
    level_m: float,
    start_hz: float,
    range_hz: tuple[float, float],
    begin: Begin,
) -> Branch | None:
    """Follow the branch that a loop would begin among stops; None where no motion repeats at its start."""
    state = None
    for factor in (1.0,) if begin == "rest" else _FROM_ABOVE:
        orbit = periodic_orbit(specimen, Harmonic(start_hz, factor * level_m), start=state)
        if orbit.outcome is not ShootingEnd.CONVERGED:
            return None
        state = orbit.state
    return periodic_branch_within(orbit, FrequencyPath((level_m,)), *range_hz)


def _last_held(
    plant: SampledPlant, law: LinearLaw, branch: Branch, points: Points, held: Floats, allowed: float
) -> int | None:
    """Return the last motion of a branch up to which a law holds every one; None where it loses the first."""
    first = int(np.argmax(held > allowed))
    if held[first] <= allowed:
        return int(points[-1])
    if first == 0:
        return None
    last, lost = int(points[first - 1]), int(points[first])
    while abs(lost - last) > 1:
        middle = (last + lost) // 2
        if branch_multipliers(plant, law, branch, [middle])[0] <= allowed:
            last = middle
        else:
            lost = middle
    return last


def branch_multipliers(plant: SampledPlant, law: LinearLaw, branch: Branch, points: Iterable[int]) -> Floats:
    """Return the largest multiplier over a period of motions of a branch, with the law acting.

    Parameters
    ----------
    plant, law
        `loop_multiplier`.
    branch
        Of the plant's specimen.
    points
        Which of its motions.

    Returns
    -------
    Magnitudes, shape (points,).
    """
    rate_hz = plant.timing.rate_hz
    courses = [motion_slopes(plant.specimen, branch, point, rate_hz) for point in points]
    return np.array([loop_multiplier(plant, law, *each) for each in courses])


def motion_slopes(
    specimen: Specimen, branch: Branch, point: int, rate_hz: float
) -> tuple[Floats, Floats, int, int]:
    """Return the slopes of the spring's force along one motion of a branch, with all its harmonics.

    Parameters
    ----------
    specimen, branch
        The branch is the specimen's.
    point
        Which of its motions.
    rate_hz
        Samples a second.

    Returns
    -------
    Stiffness, damping, periods and parts, as `loop_multiplier` takes them.
    """
    spring = spring_of(specimen)
    drive = Harmonic(float(branch.frequencies_hz[point]), float(branch.amplitudes_m[point]))
    samples = rate_hz / drive.frequency_hz * np.array(_PERIODS)
    best = int(np.argmin(np.maximum(np.abs(np.round(samples) / samples - 1.0), _WHOLE)))
    periods, count = _PERIODS[best], round(samples[best])
    parts, wave = (ceil(1.0 / (rate_hz * _PART_S)), _WAVE_OF_STOPS) if spring.kinks else (1, _WAVE)
    states = PeriodMap(specimen).orbit(branch.states[point], drive, wave).states[:wave]
    turns = (np.arange(count * parts) + 0.5) * periods / (count * parts)
    p, rate = (
        np.interp(turns, np.arange(wave) / wave, states[:, y] - states[:, z], period=1.0)
        for y, z in ((Y, Z), (VY, VZ))
    )
    return spring.stiffness(p, rate), spring.damping(p, rate), periods, parts
