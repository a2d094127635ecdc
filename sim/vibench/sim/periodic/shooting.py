"""Periodic motions with impacts by shooting: fixed points of the exact period map. SI units.

Newton's iteration on the period map finds stable and unstable motions with any number of drive periods
(Nayfeh and Balachandran, Applied Nonlinear Dynamics, Wiley 1995, section 6.4).
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import islice
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from ..engine.run import (
    MAX_IMPACT_RATE_HZ,
    Accuracy,
    NativeRun,
    Outcome,
    RunRecord,
    most_impacts,
    start_motion,
)
from ..motion.integrate import Trajectory, integrate
from ..motion.response import Response, steady_response
from ..specimen.contact_laws import NoContact, PowerLaw, RigidStops
from ..specimen.drive import Harmonic
from ..specimen.specimen import Complex, Floats, Specimen, Y, Z, state_scales
from ..specimen.stops import member
from .branch import BifurcationKind, OrbitReport, OrbitShape, OrbitShapeWord, OrbitSigns
from .floquet import multipliers
from .harmonic_balance import phasors_of
from .newton import NEUTRAL, newton_iterates, size_of

# Exact map of a state over a whole or half period, with derivatives. SI units.
#
# A mirrored motion has the opposite state half a drive period later. It is a fixed point of the half-period
# map: integrate over half a period, then change all signs. The derivative with respect to the state is exact,
# because tangent vectors are integrated with the motion. If an impact on a rigid stop approaches grazing, the
# derivative tends to infinity. Derivatives with respect to frequency and amplitude are fourth-order central
# differences at reference accuracy, with steps far above the integration error (1e-10) and far below the gap.
# They are accurate to five to seven digits, which is enough for Newton's iteration, their only use.

DIFFERENCE = 1e-5
"""Finite-difference step for derivatives with respect to a drive parameter, relative to the parameter."""
OFFSETS, WEIGHTS = (-2.0, -1.0, 1.0, 2.0), (1.0 / 12.0, -8.0 / 12.0, 8.0 / 12.0, -1.0 / 12.0)
"""Offsets (in steps) and weights of the fourth-order central difference quotient."""


@dataclass(frozen=True, eq=False)
class PeriodMap:
    """Map of a state over a whole or half period, whose fixed points are periodic motions."""

    specimen: Specimen
    shape: OrbitShape = OrbitShape.REPEATED
    periods: int = 1
    """Period of the motion in drive periods."""

    def __post_init__(self) -> None:
        if self.periods < 1:
            raise ValueError(f"A motion of {self.periods} periods is not allowed: give 1 or more.")
        if self.shape is OrbitShape.MIRRORED and self.periods % 2 == 0:
            raise ValueError(
                f"A mirrored motion cannot have {self.periods} periods: give an odd number, or REPEATED."
            )

    @property
    def turns(self) -> float:
        """Time that the period map covers, in drive periods."""
        return 0.5 * self.periods if self.shape is OrbitShape.MIRRORED else float(self.periods)

    @property
    def simpler(self) -> "PeriodMap | None":
        """Period map for motions that are mirrored or have half the period; None if these cannot exist."""
        if self.shape is OrbitShape.MIRRORED:
            return None
        if self.periods % 2 == 0:
            return replace(self, periods=self.periods // 2)
        lower, upper = self.specimen.gaps_m
        return replace(self, shape=OrbitShape.MIRRORED) if lower == upper else None

    def image(self, state: Floats, drive: Harmonic) -> Floats:
        """Return the map's final state for a state at drive phase zero, (6,); NaN if the run fails."""
        if not self._may_start(state):
            return np.full(6, math.nan)
        run = self._run(state, drive, self.turns)
        if run.outcome is not Outcome.REACHED_END:
            return np.full(6, math.nan)
        return -run.final_state if self.shape is OrbitShape.MIRRORED else run.final_state

    def response(self, state: Floats, drive: Harmonic) -> Response:
        """Return the responses of the motion from a state for one period."""
        period_s = self.periods / drive.frequency_hz
        return steady_response(self.specimen, drive, Accuracy.REFERENCE, period_s, period_s, state)

    def orbit(self, state: Floats, drive: Harmonic, samples: int) -> Trajectory:
        """Return the motion from a state for one period, with ``samples`` samples per drive period."""
        return self._run(state, drive, float(self.periods), samples * drive.frequency_hz)

    def iterates(
        self, state: Floats, drive: Harmonic, halvings: int = 0
    ) -> Iterator[tuple[Floats, Floats, Floats]]:
        """Yield state, closure error and scaled Jacobian of Newton's iteration; see `newton_iterates`."""

        def image(state: Floats) -> tuple[Floats, Floats]:
            if not self._may_start(state):
                return np.full(6, math.nan), np.full((6, 6), math.nan)
            after, jacobian = flow_derivative(self.specimen, drive, state, self.turns / drive.frequency_hz)
            return (-after, -jacobian) if self.shape is OrbitShape.MIRRORED else (after, jacobian)

        return newton_iterates(image, state, state_scales(self.specimen, drive), halvings)

    def frequency_slope(self, state: Floats, drive: Harmonic) -> Floats:
        """Return the scaled derivative d(final state) / d ln(frequency), shape (6,)."""
        return self._slope(state, drive, lambda part: replace(drive, frequency_hz=part * drive.frequency_hz))

    def amplitude_slope(self, state: Floats, drive: Harmonic) -> Floats:
        """Return the scaled derivative d(final state) / d ln(amplitude), shape (6,)."""
        return self._slope(state, drive, lambda part: replace(drive, amplitude_m=part * drive.amplitude_m))

    def _slope(self, state: Floats, drive: Harmonic, scaled: Callable[[float], Harmonic]) -> Floats:
        images = [self.image(state, scaled(1.0 + offset * DIFFERENCE)) for offset in OFFSETS]
        return np.asarray(np.dot(WEIGHTS, images) / (DIFFERENCE * state_scales(self.specimen, drive)))

    def _may_start(self, state: Floats) -> bool:
        """Return whether a run can start from a state; Newton's method may try states beyond a rigid stop."""
        match self.specimen.contact:
            case RigidStops():
                lower, upper = self.specimen.gaps_m
                return bool(-lower <= state[Y] - state[Z] <= upper)
            case _:
                return bool(np.all(np.isfinite(state)))

    def _run(
        self, state: Floats, drive: Harmonic, turns: float, sample_rate_hz: float | None = None
    ) -> Trajectory:
        return integrate(
            self.specimen,
            drive,
            turns / drive.frequency_hz,
            Accuracy.REFERENCE,
            state,
            sample_rate_hz=sample_rate_hz,
        )


NEWTON_ITERATIONS = 30
MOST_HALVINGS = 8
RETURNED = 1e-9
"""Largest allowed closure error of a periodic motion: (final - initial state) / scale of the state."""
FLOW_ERROR = 1e-10
"""Assumed integration error in a period at reference accuracy, relative to the state's scale; ten times the
measured error (docs/accuracy.md)."""
SAMPLES = 4096
"""Number of samples per drive period from which the responses of y and z are computed."""
SETTLING_PERIODS = 400
"""Length, in drive periods, of the run from rest whose end is the default initial guess."""


class ShootingEnd(StrEnum):
    """Outcome of shooting, with advice to the user."""

    CONVERGED = "converged"
    NO_ORBIT = "no periodic motion near the start: start elsewhere, or ask for another shape or period"


@dataclass(frozen=True, eq=False)
class PeriodicOrbit(OrbitReport):
    """Periodic motion found by shooting, with its stability and responses.

    ``error`` bounds the errors of the motion and of the responses of x and p: closure and integration error
    times |(map - I)^-1|.
    """

    period_map: PeriodMap
    defect: float
    """Closure error: (final - initial state) / scale of the state."""
    outcome: ShootingEnd

    @property
    def floquet_multipliers(self) -> Complex:
        """Floquet multipliers over the whole period of the motion, largest first, shape (6,)."""
        return self.signs.over_period

    @property
    def is_stable(self) -> bool:
        """Whether all Floquet multipliers lie inside the unit circle."""
        return bool(abs(self.floquet_multipliers[0]) < 1.0 - NEUTRAL)

    @property
    def impacts(self) -> int:
        """Number of contacts that begin in a period of the motion."""
        return self.signs.contacts


def periodic_orbit(
    specimen: Specimen,
    drive: Harmonic,
    shape: OrbitShape | OrbitShapeWord = OrbitShape.REPEATED,
    periods: int = 1,
    start: ArrayLike | None = None,
) -> PeriodicOrbit:
    """Return the periodic motion near an initial state; check its ``outcome`` first.

    Raises ValueError when the phase of the drive is not zero, or its amplitude is zero.

    Parameters
    ----------
    specimen, drive
        Specimen, and drive with positive amplitude and phase zero.
    shape, periods
        Symmetry (see `OrbitShape`), and period in drive periods, which is odd for a mirrored motion.
    start
        x, y, z, vx, vy, vz at time zero, shape (6,). None for the state 400 periods after a start from rest.
    """
    if drive.amplitude_m == 0.0 or drive.phase_rad != 0.0:
        raise ValueError(
            f"Drive {drive} is not allowed for shooting: give a positive amplitude and phase zero."
        )
    mapping = PeriodMap(specimen, member(OrbitShape, shape), periods)
    settling = SETTLING_PERIODS / drive.frequency_hz
    first = integrate(specimen, drive, settling).final_state if start is None else start_motion(start)
    for found in islice(mapping.iterates(first, drive, MOST_HALVINGS), NEWTON_ITERATIONS + 1):
        if not size_of(found[1]) > RETURNED:
            break
    return describe_orbit(mapping, drive, *found)


def describe_orbit(
    mapping: PeriodMap, drive: Harmonic, state: Floats, gone: Floats, derivative: Floats
) -> PeriodicOrbit:
    """Return the periodic motion from ``state`` with its responses.

    ``gone`` and ``derivative`` are closure error and Jacobian of the scaled map; see `newton_iterates`.
    """
    run = mapping.orbit(state, drive, SAMPLES)
    moved = np.full((mapping.periods * SAMPLES, 3), math.nan)  # NaN remains if the run has failed
    moved[: len(run.states)] = run.states[: len(moved), :3]
    seen = mapping.response(state, drive)
    lines = np.array(
        [seen.line_x_m, *(phasors_of(moved[:, k])[mapping.periods] for k in (Y, Z)), seen.line_p_m]
    )
    scales = state_scales(mapping.specimen, drive)
    largest = [seen.largest_x_m, *np.abs(moved[:, [Y, Z]]).max(axis=0), seen.largest_p_m]
    defect = size_of(gone)
    found = bool(defect <= RETURNED and np.all(np.isfinite(derivative)) and np.all(np.isfinite(lines)))
    return PeriodicOrbit(
        drive=drive,
        period_map=mapping,
        state=state,
        signs=_signs(mapping, drive, state, np.nan_to_num(derivative), run),
        defect=defect,
        error=_missing(derivative, gone, size_of(state / scales)) * float(scales[0] / abs(lines[3])),
        response_i=np.array(largest) / drive.amplitude_m,
        response_ii=np.abs(lines) / drive.amplitude_m,
        outcome=ShootingEnd.CONVERGED if found else ShootingEnd.NO_ORBIT,
    )


def _missing(derivative: Floats, gone: Floats, size: float) -> float:
    """Return the error bound: closure plus integration error, times the norm of (map - identity)^-1.

    The integration error grows with ``size``, the state divided by its scale, if this ratio is above 1.
    """
    slope = derivative - np.eye(6)
    if not bool(np.all(np.isfinite(slope)) and np.all(np.isfinite(gone))):
        return math.inf
    off = size_of(gone) + FLOW_ERROR * max(1.0, size)
    return float(np.abs(np.linalg.pinv(slope)).sum(axis=1).max() * off)


def _signs(
    mapping: PeriodMap, drive: Harmonic, state: Floats, derivative: Floats, run: Trajectory
) -> OrbitSigns:
    simpler = mapping.simpler
    scales = state_scales(mapping.specimen, drive)
    apart = np.zeros(0) if simpler is None else (simpler.image(state, drive) - state) / scales
    joins = None
    if simpler is not None:
        is_mirror = simpler.shape is OrbitShape.MIRRORED
        joins = BifurcationKind.SYMMETRY_BREAKING if is_mirror else BifurcationKind.PERIOD_DOUBLING
    return OrbitSigns(
        multipliers(derivative),
        run.impacts.count,
        mapping.shape,
        apart,
        joins,
        _grazing_distance(mapping.specimen, drive, run),
    )


def _grazing_distance(specimen: Specimen, drive: Harmonic, run: Trajectory) -> float:
    """Return the distance from grazing: (distance to stop) / gap or, in contact, (dp/dt) / (gap * 2 pi f)."""
    if isinstance(specimen.contact, NoContact | PowerLaw):
        return math.inf
    lower, upper = specimen.gaps_m
    p = run.states[:, Y] - run.states[:, Z]
    gap = min(lower, upper)
    short = np.minimum(upper - p, lower + p)
    dips = (short[1:-1] <= short[:-2]) & (short[1:-1] <= short[2:]) & (short[1:-1] > 0.0)
    nearest = float(short[1:-1][dips].min(initial=math.inf)) / gap
    rate = np.abs(run.states[:, Y + 3] - run.states[:, Z + 3])
    # The approach speed is the speed at the last sample before each contact.
    places = np.searchsorted(run.time_s, run.impacts.times_s) - 1
    slowest = float(rate[np.clip(places, 0, None)].min(initial=math.inf))
    return min(nearest, slowest / (gap * 2.0 * math.pi * drive.frequency_hz))


class PhaseReference(StrEnum):
    """Motion of m0 that defines the phase at a phase resonance."""

    RELATIVE = "relative"
    """Motion relative to the base: for the lowest mode, or if contacts limit the relative motion."""
    ABSOLUTE = "absolute"
    """Absolute motion: for a mode far above the other modes, where m0 hardly follows the base."""

    def motion(self, transmissibility: complex) -> complex:
        """Return the ratio of this motion of m0 to the base motion; transmissibility - 1 if relative."""
        return transmissibility - 1.0 if self is PhaseReference.RELATIVE else transmissibility


PhaseReferenceWord = Literal["relative", "absolute"]


def smallest_period(section: Floats, scales: Floats, tolerance: float = 1e-6, most: int = 32) -> int | None:
    """Return the smallest number of drive periods after which a motion repeats; None if it does not repeat.

    Parameters
    ----------
    section
        States of the settled motion once per drive period, at least two periods long, shape (n, 6).
    scales
        Scales of a state from `state_scales`, shape (6,).
    tolerance
        Largest change of a state, relative to its scale, at which a motion counts as repeating.
    most
        Longest period to try.
    """
    points = section / scales
    for period in range(1, min(most, len(points) // 2) + 1):
        change = points[-period:] - points[-2 * period : len(points) - period]
        if float(np.abs(change).max()) < tolerance:
            return period
    return None


def flow_derivative(
    specimen: Specimen,
    drive: Harmonic,
    state: ArrayLike,
    duration_s: float,
    accuracy: Accuracy = Accuracy.REFERENCE,
) -> tuple[Floats, Floats]:
    """Return the final state of a run from time zero of the drive, and d(final state) / d(initial state).

    The shapes are (6,) and (6, 6), as in `NativeRun.advance_with_jacobian`; NaN if the run did not finish.

    Parameters
    ----------
    specimen, drive
        Specimen, and motion of its base.
    state
        x, y, z, vx, vy, vz at time zero, shape (6,).
    duration_s
        Length of the run [s].
    accuracy
        Accuracy of the motion and of its derivative.
    """
    run = NativeRun(specimen, drive, start_motion(state), accuracy.tolerance)
    return run.advance_with_jacobian(duration_s, RunRecord(most_impacts(MAX_IMPACT_RATE_HZ, duration_s)))
