"""Follow any family of periodic motions along a parameter, and gather what is on the way into a branch."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..kernels import Vector
from ._branch import BifurcationKind, Branch, BranchEvent, Parameter
from ._continuation import ArcEnd, ArcPoint, ArcSteps, Curve, correct, locate, trace
from ._orbit_events import OrbitSigns, bifurcations_between, sign_of


@dataclass(frozen=True, eq=False)
class OrbitReport:
    """What a branch keeps of one point."""

    frequency_hz: float
    amplitude_m: float
    response_i: Vector
    """Shape (n + 1,)."""
    response_ii: Vector
    """Shape (n + 1,)."""
    state: Vector
    """Displacements and velocities at the drive's time zero, shape (2 n,)."""
    signs: OrbitSigns
    left_out: float


class Family(Curve, Protocol):
    """A curve whose points are periodic motions."""

    @property
    def tolerance(self) -> float:
        """Largest error estimate that a point may have."""
        ...

    def report(self, point: Vector) -> OrbitReport:
        """Describe the motion at a point."""
        ...

    def refined(self, point: Vector, tangent: Vector) -> "tuple[Family, Vector, Vector] | None":
        """Give the family at a higher resolution, with a point and a tangent carried over to it.

        None when this is the highest.
        """
        ...


@dataclass(frozen=True, eq=False)
class Followed:
    """A branch, and where its last point lies in which family: to look closer, or to go on."""

    branch: Branch
    family: Family
    last: Vector


@dataclass
class _Gathered:
    reports: list[OrbitReport]
    events: list[BranchEvent]

    def add_event(self, kind: BifurcationKind, report: OrbitReport) -> None:
        last = len(self.reports) - 1
        self.events.append(BranchEvent(kind, report.frequency_hz, report.amplitude_m, report.state, last))


RANGE_LENGTH = 10.0
"""The parameter's range counts as this many units of length, the gap or the spring's length scale as one."""


def branch_range(
    parameter: Parameter, frequency_hz: float, amplitude_m: float, stop: float
) -> tuple[float, float]:
    """Give the value at which a branch to ``stop`` starts, and how much of it is a unit of length [Hz, m]."""
    value = {Parameter.FREQUENCY: frequency_hz, Parameter.AMPLITUDE: amplitude_m}[parameter]
    if not 0.0 < stop < math.inf or stop == value:
        msg = f"A branch from {value} to {stop} is not allowed: positive, and two different ends."
        raise ValueError(msg)
    return value, abs(stop - value) / RANGE_LENGTH


def follow(
    family: Family,
    start: Vector,
    toward: float,
    bounds: tuple[float, float],
    steps: ArcSteps,
    parameter: Parameter,
) -> Followed:
    """Follow a family from a point on it; the resolution rises where the error estimate asks for it.

    Parameters
    ----------
    family
        At the resolution to begin with.
    start
        On the family.
    toward, bounds
        Sign of the first step, and range, of the family's scaled parameter.
    steps
        Lengths and tolerances.
    parameter
        What the family's parameter is.

    """
    gathered = _Gathered([], [])
    while True:
        end, last = _follow_at(family, start, toward, bounds, steps, gathered)
        if end is not None:
            return Followed(_branch(gathered, parameter, end), family, last.point)
        refined = family.refined(last.point, last.tangent)
        if refined is None:
            return Followed(_branch(gathered, parameter, ArcEnd.STEP_TOO_SHORT), family, last.point)
        finer, guess, normal = refined
        point, iterations = correct(finer, guess, normal / np.linalg.norm(normal), steps.tolerance)
        if iterations == 0:
            return Followed(_branch(gathered, parameter, ArcEnd.STEP_TOO_SHORT), family, last.point)
        family, start, toward = finer, point, float(last.tangent[-1])


def _follow_at(
    family: Family,
    start: Vector,
    toward: float,
    bounds: tuple[float, float],
    steps: ArcSteps,
    gathered: _Gathered,
) -> tuple[ArcEnd | None, ArcPoint]:
    """Follow at one resolution; gives why the branch ended (None: a finer one should go on), and where."""
    points = trace(family, start, toward, bounds, steps)
    before = next(points)
    first = family.report(before.point)
    signs = first.signs
    if not gathered.reports:
        # Elsewhere the point at which a finer resolution took over is known already.
        gathered.reports.append(first)
    for here in points:
        if here.end is ArcEnd.STEP_TOO_SHORT:
            return None, here
        report = family.report(here.point)
        if here.is_fold:
            gathered.add_event(BifurcationKind.FOLD, report)
            continue
        if report.left_out > family.tolerance and family.refined(before.point, before.tangent) is not None:
            return None, before
        if here.end is ArcEnd.TOO_MANY_POINTS:
            return here.end, here
        for kind in bifurcations_between(signs, report.signs):
            _add_located(family, before, here, kind, signs, steps, gathered)
        gathered.reports.append(report)
        if here.end is not None:
            return here.end, here
        before, signs = here, report.signs
    return ArcEnd.TOO_MANY_POINTS, before


def _add_located(
    family: Family,
    before: ArcPoint,
    after: ArcPoint,
    kind: BifurcationKind,
    signs: OrbitSigns,
    steps: ArcSteps,
    gathered: _Gathered,
) -> None:
    def measure(point: ArcPoint) -> float:
        return sign_of(kind, family.report(point.point).signs, signs)

    found = locate(family, before, after, measure, steps.tolerance)
    if found is None:
        return
    report = family.report(found.point)
    if kind is BifurcationKind.NEIMARK_SACKER and not report.signs.has_pair_on_circle:
        return
    gathered.add_event(kind, report)


def _branch(gathered: _Gathered, parameter: Parameter, end: ArcEnd) -> Branch:
    reports = gathered.reports
    return Branch(
        parameter=parameter,
        frequencies_hz=np.array([r.frequency_hz for r in reports]),
        amplitudes_m=np.array([r.amplitude_m for r in reports]),
        response_i=np.array([r.response_i for r in reports]),
        response_ii=np.array([r.response_ii for r in reports]),
        states=np.array([r.state for r in reports]),
        multipliers=np.array([r.signs.over_period for r in reports]),
        left_out=np.array([r.left_out for r in reports]),
        events=tuple(gathered.events),
        end=end,
    )
