"""Follow periodic motions along a parameter, and return the points as a branch."""

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, ClassVar, Protocol

import numpy as np
import scipy

from ..specimen.drive import Harmonic, Parameter
from ..specimen.specimen import Floats
from .branch import (
    POINTWISE,
    BifurcationKind,
    Branch,
    BranchEvent,
    OrbitReport,
    OrbitSigns,
    bifurcations_between,
    is_joined,
    sign_of,
)
from .continuation import ArcEnd, ArcPoint, ArcSteps, Curve, correct, locate, trace


@dataclass(frozen=True)
class FrequencyPath:
    """Path along drive frequency, with constant or frequency-dependent amplitude."""

    amplitudes_m: tuple[float, ...]
    """Drive amplitude at each of the frequencies, or one constant amplitude [m]."""
    frequencies_hz: tuple[float, ...] = ()
    """Ascending frequencies [Hz]; the amplitude is a monotone cubic between these, and constant outside."""
    parameter: ClassVar = Parameter.FREQUENCY

    def __post_init__(self) -> None:
        given = max(1, len(self.frequencies_hz))
        ascending = all(before < after for before, after in pairwise(self.frequencies_hz))
        if len(self.amplitudes_m) != given or given == 1 != len(self.amplitudes_m) or not ascending:
            raise ValueError(
                f"{len(self.amplitudes_m)} amplitudes at {len(self.frequencies_hz)} frequencies are not "
                "allowed: give one amplitude, or one amplitude for each of two or more ascending frequencies."
            )
        for amplitude in self.amplitudes_m:
            _refuse_unless_positive("amplitude", amplitude, "m")

    def drive(self, value: float) -> tuple[float, float]:
        """Return frequency [Hz] and amplitude [m] for a frequency on the path."""
        if len(self.amplitudes_m) == 1:
            return value, self.amplitudes_m[0]
        return value, float(self._curve(self._clip(value)))

    def slopes(self, value: float) -> tuple[float, float]:
        """Return the derivatives of frequency (1) and amplitude [m/Hz] with respect to frequency."""
        if len(self.amplitudes_m) == 1 or self._clip(value) != value:
            return 1.0, 0.0
        return 1.0, float(self._curve(value, 1))

    @cached_property
    def _curve(self) -> "scipy.interpolate.PchipInterpolator":
        return scipy.interpolate.PchipInterpolator(self.frequencies_hz, self.amplitudes_m)

    def _clip(self, value: float) -> float:
        return min(max(value, self.frequencies_hz[0]), self.frequencies_hz[-1])


@dataclass(frozen=True)
class AmplitudePath:
    """Path along drive amplitude, at one frequency."""

    frequency_hz: float
    parameter: ClassVar = Parameter.AMPLITUDE

    def __post_init__(self) -> None:
        _refuse_unless_positive("frequency", self.frequency_hz, "Hz")

    def drive(self, value: float) -> tuple[float, float]:
        """Return frequency [Hz] and amplitude [m] for an amplitude on the path."""
        return self.frequency_hz, value

    def slopes(self, value: float) -> tuple[float, float]:  # noqa: ARG002 - the same everywhere
        """Return the derivatives of frequency (0) and amplitude (1) with respect to amplitude."""
        return 0.0, 1.0


DrivePath = FrequencyPath | AmplitudePath
"""A curve in the plane of drive frequency and amplitude."""


def _refuse_unless_positive(name: str, value: float, unit: str) -> None:
    if not 0.0 < value < math.inf:
        raise ValueError(f"A drive {name} of {value} {unit} is not allowed: it must be positive and finite.")


class Family(Curve, Protocol):
    """Equations of a curve whose points are periodic motions."""

    @property
    def path(self) -> DrivePath:
        """Path of the drive in the plane of frequency and amplitude."""
        ...

    @property
    def tolerance(self) -> float:
        """Largest allowed error estimate of a point; above this error, the resolution is increased."""
        ...

    def report(self, point: Floats) -> OrbitReport:
        """Return the results (responses, stability) of the motion at a point of the curve."""
        ...

    def refine(self, point: Floats, tangent: Floats) -> "tuple[Family, Floats, Floats] | None":
        """Return the family at a higher resolution, with a point and a tangent at this resolution.

        None if the family already has the highest resolution.
        """
        ...


RANGE_LENGTH = 10.0
"""Length of the parameter range in scaled units, in which the gap or the spring's length scale is 1."""


def parameter_value(path: DrivePath, drive: Harmonic) -> float:
    """Return the varying quantity of a path for a drive: frequency [Hz] or amplitude [m]."""
    return drive.frequency_hz if path.parameter is Parameter.FREQUENCY else drive.amplitude_m


def range_scale(low: float, high: float, value: float) -> float:
    """Return the change of the parameter that counts as one unit of arc length [Hz, or m]."""
    if not 0.0 < low < high < math.inf or not low <= value <= high:
        raise ValueError(
            f"A branch from {low} to {high} through {value} is not allowed: give 0 < low <= value <= high."
        )
    return (high - low) / RANGE_LENGTH


def follow(
    family: Family, start: Floats, toward: float, bounds: tuple[float, float], steps: ArcSteps
) -> Branch:
    """Follow a family from one of its points; increase the resolution where the error is too large.

    Parameters
    ----------
    family
        Family at its first resolution.
    start
        Point on the curve, from which to start.
    toward, bounds
        Sign of the first change of the scaled parameter, and range of this parameter.
    steps
        Step lengths and tolerances.
    """
    followed = _FollowedBranch(family, steps)
    while True:
        end, last = followed.go_on(start, toward, bounds)
        if end is not None:
            return followed.branch(end)
        refined = followed.family.refine(last.point, last.tangent)
        if refined is None:
            return followed.end_where_stuck()
        finer, guess, normal = refined
        point, iterations = correct(finer, guess, normal / np.linalg.norm(normal), steps.tolerance)
        if iterations == 0:
            return followed.end_where_stuck()
        followed.family, start, toward = finer, point, float(last.tangent[-1])


NEARLY_GRAZING = 0.01
"""Distance from grazing [gaps] within which a failed continuation counts as ending at grazing."""


def follow_both_ways(family: Family, start: Floats, bounds: tuple[float, float], steps: ArcSteps) -> Branch:
    """Follow a family from a point in both directions, or once around if the branch is closed."""
    onward = follow(family, start, 1.0, bounds, steps) if start[-1] < bounds[1] else None
    if onward is not None and onward.end is ArcEnd.CLOSED:
        return replace(onward, begin=ArcEnd.CLOSED)
    back = follow(family, start, -1.0, bounds, steps) if start[-1] > bounds[0] else None
    if back is None or onward is None:
        whole = onward or back
        assert whole is not None
        return replace(whole, begin=ArcEnd.REACHED_BOUND)
    # Both branches start at the same point: reverse one branch, then append the other branch to it.
    before = len(back.frequencies_hz) - 1
    arrays: dict[str, Any] = {
        name: np.concatenate([getattr(back, name)[:0:-1], getattr(onward, name)]) for name in POINTWISE
    }
    events = (
        *(replace(each, index=max(before - 1 - each.index, 0)) for each in reversed(back.events)),
        *(replace(each, index=before + each.index) for each in onward.events),
    )
    return replace(onward, **arrays, events=events, begin=back.end)


@dataclass
class _FollowedBranch:
    """Points and events of a branch while it is followed."""

    family: Family
    """Family of motions at the current resolution."""
    steps: ArcSteps
    reports: list[OrbitReport] = field(default_factory=list)
    events: list[BranchEvent] = field(default_factory=list)

    def go_on(
        self, start: Floats, toward: float, bounds: tuple[float, float]
    ) -> tuple[ArcEnd | None, ArcPoint]:
        """Follow at one resolution; return the reason for the end (None: refine) and the last point."""
        family = self.family
        points = trace(family, start, toward, bounds, self.steps)
        before = next(points)
        first = family.report(before.point)
        signs = first.signs
        if not self.reports:
            # In later calls, the first point has already been reported, at a lower resolution.
            self.reports.append(first)
        for here in points:
            if here.end in (ArcEnd.STEP_TOO_SHORT, ArcEnd.OUT_OF_TIME):
                return (None if here.end is ArcEnd.STEP_TOO_SHORT else here.end), here
            report = family.report(here.point)
            if is_joined(signs, report.signs) and not here.is_fold:
                self._end_on_simpler(before, here, signs)
                return ArcEnd.JOINED, here
            if here.is_fold:
                self._add_event(BifurcationKind.FOLD, report)
                continue
            if report.error > family.tolerance and family.refine(before.point, before.tangent) is not None:
                return None, before
            if here.end is ArcEnd.TOO_MANY_POINTS:
                return here.end, here
            for kind in bifurcations_between(signs, report.signs):
                self._locate_event(before, here, kind, signs)
            self.reports.append(report)
            if here.end is not None:
                return here.end, here
            before, signs = here, report.signs
        return ArcEnd.TOO_MANY_POINTS, before

    def end_where_stuck(self) -> Branch:
        """End a branch that cannot be continued; add a grazing event if a rigid stop is being grazed."""
        if self.reports[-1].signs.grazing_distance < NEARLY_GRAZING:
            self._add_event(BifurcationKind.GRAZING, self.reports[-1])
        return self.branch(ArcEnd.STEP_TOO_SHORT)

    def branch(self, end: ArcEnd) -> Branch:
        """Return the branch as followed so far."""
        reports = self.reports
        return Branch(
            parameter=self.family.path.parameter,
            frequencies_hz=np.array([r.drive.frequency_hz for r in reports]),
            amplitudes_m=np.array([r.drive.amplitude_m for r in reports]),
            response_i=np.array([r.response_i for r in reports]),
            response_ii=np.array([r.response_ii for r in reports]),
            states=np.array([r.state for r in reports]),
            multipliers=np.array([r.signs.over_period for r in reports]),
            left_out=np.array([r.error for r in reports]),
            contacts=np.array([r.signs.contacts for r in reports], dtype=np.int64),
            events=tuple(self.events),
            end=end,
        )

    def _add_event(self, kind: BifurcationKind, report: OrbitReport) -> None:
        last, drive = len(self.reports) - 1, report.drive
        self.events.append(BranchEvent(kind, drive.frequency_hz, drive.amplitude_m, report.state, last))

    def _end_on_simpler(self, before: ArcPoint, after: ArcPoint, signs: OrbitSigns) -> None:
        """End a branch where it starts to repeat: at a motion that is mirrored or has half the period."""

        def measure(point: ArcPoint) -> float:
            return float(self.family.report(point.point).signs.apart @ signs.apart)

        found = locate(self.family, before, after, measure, self.steps.tolerance) or before
        report = self.family.report(found.point)
        last = len(self.reports) - 1
        self.events = [
            each for each in self.events if not (each.kind is BifurcationKind.FOLD and each.index == last)
        ]
        assert signs.joins is not None
        self._add_event(signs.joins, report)
        self.reports.append(report)

    def _locate_event(
        self, before: ArcPoint, after: ArcPoint, kind: BifurcationKind, signs: OrbitSigns
    ) -> None:
        def measure(point: ArcPoint) -> float:
            return sign_of(kind, self.family.report(point.point).signs, signs)

        found = locate(self.family, before, after, measure, self.steps.tolerance)
        if found is None:
            return
        report = self.family.report(found.point)
        if kind is not BifurcationKind.NEIMARK_SACKER or report.signs.has_pair_on_circle:
            self._add_event(kind, report)
