"""Law and calibration of a rig's fast loop, and a prediction of whether the loop holds a branch."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import ceil, pi
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from vibench.acquisition.errors import ConfigurationError, LimitExceeded
from vibench.acquisition.rig import LoopInput, Rig, SensorConfig, amplifier_of, shaker_of, specimen_of
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
from vibench.sim.specimen.specimen import VY, VZ, Floats, Y, Z

from .branch_continuation import BranchContinuation
from .law import LinearLaw, LoopTiming, SampledPlant, design_law, loop_multiplier, loop_transfer, pd_law
from .protocol import LoopBlock, LoopFeedback

Coefficients = NDArray[np.complex128]
LARGEST_MULTIPLIER = 0.99
"""Largest Floquet multiplier allowed along a branch; deviations then fall to a third in 100 periods."""


@dataclass(frozen=True, eq=False)
class FastLoop:
    """The law of a rig, and the plant described by the rig's configuration."""

    rig: Rig
    plant: SampledPlant
    law: LinearLaw

    @property
    def feedback(self) -> LoopFeedback:
        """The law for a controller whose inputs are sensor voltages."""
        units = np.array(_units_per_volt(self.rig))
        return LoopFeedback(
            step=_rows(self.law.step),
            inlet=_rows(self.law.inlet * units),
            output=_rows(self.law.output)[0],
            direct=_rows(self.law.direct * units)[0],
        )

    def gains(self, frequency_hz: float, harmonics: int) -> Coefficients:
        """Return base displacement per volt at each harmonic, from the model [m/V], shape (harmonics,)."""
        orders = range(1, harmonics + 1)
        return np.array([loop_transfer(self.plant, self.law, k * frequency_hz) for k in orders])

    def motions(self, blocks: Sequence[LoopBlock], frequency_hz: float) -> tuple[Coefficients, Coefficients]:
        """Return the harmonics of the displacements of base and m0 [m], shapes (blocks, orders).

        A sample is the mean since the previous sample, so it is late by half a step and slightly too small.
        Both effects are corrected.
        """
        orders, rate_hz = np.arange(1, len(blocks[0].base)), self.plant.timing.rate_hz
        turning = 2j * pi * frequency_hz * orders
        late = np.exp(0.5 * turning / rate_hz) / np.sinc(frequency_hz * orders / rate_hz)
        per_base, per_m0 = _units_per_volt(self.rig)
        base = np.array([[complex(*pair) for pair in block.base[1:]] for block in blocks])
        m0 = np.array([[complex(*pair) for pair in block.m0[1:]] for block in blocks])
        delay = np.exp(turning * _vibrometer(self.rig).delay_s)
        return per_base * base * late / turning**2, per_m0 * m0 * late * delay / turning


def fast_loop(rig: Rig) -> FastLoop:
    """Return the law of the rig's controller; raises ConfigurationError if the rig has no controller."""
    controller = rig.controller
    if controller is None:
        raise ConfigurationError(
            "following a branch needs a real-time controller, but this bench has none. Nothing was played; "
            "add [controller] to the hardware configuration"
        )
    timing = LoopTiming(controller.rate_hz, controller.latency_s)
    plant = SampledPlant(amplifier_of(rig), shaker_of(rig), specimen_of(rig), timing)
    sample = None if controller.pd_of is None else list(LoopInput).index(controller.pd_of)
    return FastLoop(rig, plant, design_law(plant) if sample is None else pd_law(plant, sample))


def require_held(fast: FastLoop, plan: BranchContinuation) -> None:
    """Refuse a branch that, according to the model, the loop would not hold.

    Raises LimitExceeded with the largest multiplier and the range that would be held, or with the reason why
    these are unknown. Nothing is played before this check.
    """
    level_m, timing = level_at(plan, plan.start_hz), fast.plant.timing
    unknown = "it is not known whether the fast loop holds the branch: "
    if isinstance(fast.plant.specimen.contact, RigidStops):
        raise LimitExceeded(
            f"{unknown}rigid stops have no finite contact force. Nothing was played; choose another "
            "contact law for the specimen in the hardware configuration, such as hertz"
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
            f"with base amplitude {level_m:.3g} m. Nothing was played; change start_hz, level or begin_from"
        )
    held = "not even the first motion"
    if hold.held_hz is not None:
        behind = f", beyond {hold.folds} fold{'s' * (hold.folds > 1)}" if hold.folds else ""
        held = f"the branch from {plan.start_hz:.5g} to {hold.held_hz:.5g} Hz{behind}"
    if hold.multiplier > LARGEST_MULTIPLIER:
        raise LimitExceeded(
            f"the fast loop would not hold the branch: the modelled loop's largest multiplier is "
            f"{hold.multiplier:.3g} at {hold.at_hz:.5g} Hz with {1e3 * timing.latency_s:.3g} ms of latency "
            f"at {timing.rate_hz:g} samples/s; at most {LARGEST_MULTIPLIER:g} is allowed. The loop would "
            f"hold {held}. Nothing was played; narrow the range, shorten the latency, or lower the level"
        )
    if hold.end not in (ArcEnd.REACHED_BOUND, ArcEnd.CLOSED):
        raise LimitExceeded(
            f"{unknown}the model can follow only {held} ({hold.end}). Nothing was played; narrow the range, "
            "or change the level"
        )


def level_at(plan: BranchContinuation, frequency_hz: float) -> float:
    """Return the required amplitude of the base displacement [m]."""
    return plan.base_level.acceleration_at(frequency_hz) / (2 * pi * frequency_hz) ** 2


def _units_per_volt(rig: Rig) -> tuple[float, float]:
    """Return base acceleration and m0 velocity per volt of their sensors [m/s2 per V, m/s per V]."""
    return rig.accelerometer.units_per_volt("m s-2"), _vibrometer(rig).units_per_volt("m s-1")


def _vibrometer(rig: Rig) -> SensorConfig:
    if rig.vibrometer is None:
        raise ConfigurationError("the loop samples the velocity of m0; add the table [vibrometer] to the rig")
    return rig.vibrometer


def _rows(table: NDArray[np.float64]) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(map(float, row)) for row in table)


Points = NDArray[np.int64]
Begin = Literal["rest", "above"]
_POINTS = 25
"""Number of motions checked along a branch, including stable ones, which a delayed law may destabilise."""
_PERIODS, _WHOLE = range(1, 41), 2e-5
"""Numbers of periods, of which one with a whole number of samples is sought; tolerance for "whole"."""
_WAVE, _WAVE_OF_STOPS = 512, 8192
"""Number of points per period at which the slope of the spring force is computed: without and with stops."""
_PART_S = 1e-6
"""Longest part of a step with a constant slope of the stops' force [s]; 1 % of a contact's duration."""
_FROM_ABOVE = (3.0, 2.5, 2.0, 1.7, 1.4, 1.2, 1.0)
"""Decreasing levels, relative to the required level, through which a motion with impacts is reached."""


@dataclass(frozen=True)
class BranchHold:
    """Part of a branch in which a law holds the motions, and the largest multiplier that was found."""

    multiplier: float
    """Largest multiplier over a period under the law, among the motions that were checked."""
    at_hz: float
    held_hz: float | None
    """End of the range in which every motion is held [Hz]; None if the first motion is not held."""
    folds: int
    end: ArcEnd | None


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
    """Return how well a law holds the model's branch at one base level, of amplitude ``level_m`` [m].

    ``plant`` and ``law`` are those that the host assumes; the specimen has no rigid stops. The branch
    starts at ``start_hz`` and stays in ``range_hz``. ``begin`` is the approach to the level: from rest, or
    from three times the level, which finds motions with impacts. Without stops, the start is from rest. The
    frequency first changes in the direction ``way``. A motion counts as held up to the multiplier
    ``allowed``. Returns None if the model has no motion at the start.
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
    """Return the branch with impacts that a loop would follow; None if no periodic motion is found."""
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
    """Return the last motion of the range in which all are held; None if the first motion is not held."""
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
    """Return the largest multipliers over a period of the motions at the indices ``points``, shape (points,).

    ``plant`` and ``law`` are as in `loop_multiplier`; the branch belongs to the plant's specimen.
    """
    rate_hz = plant.timing.rate_hz
    courses = [motion_slopes(plant.specimen, branch, point, rate_hz) for point in points]
    return np.array([loop_multiplier(plant, law, *each) for each in courses])


def motion_slopes(
    specimen: Specimen, branch: Branch, point: int, rate_hz: float
) -> tuple[Floats, Floats, int, int]:
    """Return the slopes of the spring force along one motion of a branch, including all harmonics.

    The motion has the index ``point``. The result is stiffness, damping, number of periods, and parts
    per sample of a controller with the sample rate ``rate_hz``, as for `loop_multiplier`.
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
