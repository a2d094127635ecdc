"""Branches of a request: columns of numbers, special points, and computing time."""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from vibench.sim import OrbitShape, Parameter, count_text, phase_resonance_branch
from vibench.sim.branches import (
    BranchOrigin,
    FoundBranch,
    balance_branches,
    growth_time_s,
    least_growth_time_s,
    shoot_branches,
)

from ..comparison import Curve, CurveKind, CurveOrigin
from ..signals import Reals
from ..tables import Tabular, columns
from ._requests import BranchMethod, BranchRequest


@dataclass(frozen=True)
class LineEvent:
    """Special point of a branch: a bifurcation or a grazing contact."""

    DOCUMENT: ClassVar = "kind frequency_hz amplitude_m"

    kind: str
    """Kind of the special point: fold, period doubling, Neimark-Sacker, symmetry breaking or grazing."""
    frequency_hz: float
    amplitude_m: float
    index: int
    """Index of the branch's last point before the special point."""
    response_ii: float
    """Response II of m0 at the special point, interpolated between the neighbouring points."""


@dataclass(frozen=True, eq=False)
class BranchLine(Tabular):
    """One branch with n points, in order along the branch."""

    OWN_UNITS: ClassVar = {"states": "m, m, m, m s-1, m s-1, m s-1"}
    DOCUMENT: ClassVar = "periods shape has_twin is_isolated origin begin end elapsed_s events points=motions"

    frequency_hz: Reals
    amplitude_m: Reals
    response_i: Reals
    """Largest |x|, |y|, |z| and |p|, divided by the drive amplitude, shape (n, 4)."""
    response_ii: Reals
    """Amplitude of x, y, z and p at the drive frequency, divided by the drive amplitude, shape (n, 4)."""
    states: Reals
    """x, y, z, vx, vy, vz at time zero of the drive, shape (n, 6) [m, m/s]."""
    multiplier_real: Reals
    """Real parts of the Floquet multipliers over the period of the motion, largest first, shape (n, 6)."""
    multiplier_imaginary: Reals
    impacts: NDArray[np.int64]
    """Number of contacts per period of the motion, shape (n,)."""
    error_estimate: Reals
    """Bound on the distance to the true motion, relative to the fundamental of p, shape (n,)."""
    events: tuple[LineEvent, ...]
    periods: int
    """Number of drive periods in one period of the motion."""
    shape: str
    """``"mirrored"`` if the motion is its own mirror image after half its period, else ``"repeated"``."""
    has_twin: bool
    """Whether the mirror images of the branch's motions form another branch."""
    is_isolated: bool
    """Whether the branch closes on itself."""
    origin: str
    """Method by which the branch was found."""
    begin: str
    """Reason why the branch ends at its first point."""
    end: str
    """Reason why the branch ends at its last point."""
    elapsed_s: float

    @property
    def points(self) -> int:
        """Number of points on the branch."""
        return len(self.frequency_hz)

    @property
    def motions(self) -> list[dict[str, Any]]:
        """One dictionary per point, which contains the responses of m0 and of p = y - z."""
        found = columns(
            self,
            "frequency_hz amplitude_m is_stable is_unstable largest_multiplier growth_time_s impacts "
            "response_i=response_i.T.0 response_ii=response_ii.T.0 relative_i=response_i.T.3 "
            "relative_ii=response_ii.T.3 error_estimate state=states",
        )
        return [dict(zip(found, values, strict=True)) for values in zip(*found.values(), strict=True)]

    @property
    def largest_multiplier(self) -> Reals:
        """Magnitude of the largest Floquet multiplier, shape (n,)."""
        return np.hypot(self.multiplier_real[:, 0], self.multiplier_imaginary[:, 0])

    @property
    def is_stable(self) -> NDArray[np.bool_]:
        """Whether all multipliers lie inside the unit circle by more than their error, shape (n,)."""
        return self._stability > 0

    @property
    def is_unstable(self) -> NDArray[np.bool_]:
        """Whether a multiplier lies outside the unit circle by more than its error, shape (n,)."""
        return self._stability < 0

    @property
    def _stability(self) -> NDArray[np.int64]:
        """1 if stable, -1 if unstable, 0 if undecided, as without damping; shape (n,)."""
        inside = 1.0 - self.largest_multiplier
        is_clear = np.abs(inside) > np.where(self.impacts, np.fmax(self.error_estimate, 1e-9), 1e-9)
        return np.where(is_clear, np.sign(inside), 0.0).astype(np.int64)

    @property
    def growth_time_s(self) -> Reals:
        """Time in which a small deviation grows by a factor e; infinite if it does not grow, shape (n,)."""
        return growth_time_s(self.frequency_hz, self.largest_multiplier, self.periods)

    def axis_values(self, parameter: Parameter) -> Reals:
        """Return the values of the varied parameter: frequencies [Hz] or amplitudes [m]."""
        return self.frequency_hz if parameter is Parameter.FREQUENCY else self.amplitude_m

    def pieces(self) -> Iterator[tuple[CurveOrigin, slice]]:
        """Yield the stable, undecided and unstable stretches; neighbouring stretches share a point."""
        stability = np.minimum(self._stability[1:], self._stability[:-1])
        edges = [0, *(np.flatnonzero(np.diff(stability)) + 1).tolist(), self.points - 1]
        for first, last in pairwise(edges):
            if last > first:
                yield _ORIGINS[stability[first]], slice(first, last + 1)


_ORIGINS = (CurveOrigin.UNDECIDED, CurveOrigin.STABLE, CurveOrigin.UNSTABLE)
"""Origins of curves by stability: 0, 1, -1."""


def line_of(found: FoundBranch) -> BranchLine:
    """Convert a computed branch to a `BranchLine`."""
    branch = found.branch
    return BranchLine(
        **columns(
            branch,
            "frequency_hz=frequencies_hz amplitude_m=amplitudes_m response_i response_ii states "
            "impacts=contacts error_estimate=left_out end=end.value",
        ),
        **columns(found, "periods shape=shape.value has_twin is_isolated origin=origin.value elapsed_s"),
        multiplier_real=branch.multipliers.real.copy(),
        multiplier_imaginary=branch.multipliers.imag.copy(),
        events=tuple(
            LineEvent(
                **columns(each, "kind=kind.value frequency_hz amplitude_m index"),
                response_ii=_response_at(found, each.index, each.parameter(branch.parameter)),
            )
            for each in branch.events
        ),
        begin="the search started here" if branch.begin is None else branch.begin.value,
    )


def _response_at(found: FoundBranch, index: int, value: float) -> float:
    """Return Response II of m0 at a parameter ``value`` between point ``index`` and the next point."""
    branch = found.branch
    two = slice(index, index + 2)
    place, size = branch.parameters[two], branch.response_ii[two, 0]
    if len(place) < 2 or place[0] == place[1]:
        return float(size[0])
    part = min(max((value - place[0]) / (place[1] - place[0]), 0.0), 1.0)
    return float(size[0] + part * (size[1] - size[0]))


_MORE_EXACT = {
    BranchMethod.SHOOTING: "More time does not reduce the errors of shooting.",
    BranchMethod.BALANCE: "The other motions need more harmonics (--harmonics), or the method 'shooting'.",
}


@dataclass(frozen=True, eq=False)
class BranchDiagram(Tabular):
    """All branches found for one request."""

    DOCUMENT: ClassVar = "options=request branches=lines least_growth_time_s elapsed_s"

    request: BranchRequest
    lines: tuple[BranchLine, ...]
    elapsed_s: float

    @property
    def points(self) -> int:
        """Number of motions on all branches."""
        return sum(line.points for line in self.lines)

    @property
    def largest_error(self) -> float:
        """Largest of the branches' median errors (errors grow near folds); NaN without branches."""
        errors = [np.median(line.error_estimate) for line in self.lines]
        return float(max(errors, default=float("nan")))

    @property
    def is_complete(self) -> bool:
        """Whether the search finished within the requested time."""
        return self.request.time_s is None or self.elapsed_s < self.request.time_s

    @property
    def cost_sentence(self) -> str:
        """Return a sentence on the number, the error and the computing time of the branches."""
        over = "" if self.is_complete else " The time limit was reached: more branches may exist."
        if not self.lines:
            none = "No periodic motion was found"
            if self.request.method is not BranchMethod.SHOOTING:
                none = (
                    f"Harmonic balance with at most {self.request.balance_options.most} harmonics found no "
                    "motion. Either no motion has the drive's period, or more harmonics are needed, as with "
                    "impacts; use the method 'shooting'"
                )
            return f"{none}; {self.elapsed_s:.1f} s.{over}"
        isolated = sum(line.is_isolated for line in self.lines)
        worst = max(float(np.max(line.error_estimate)) for line in self.lines)
        wanted, reached = self.request.error, ""
        branches, motions = count_text(len(self.lines), "branch"), count_text(self.points, "motion")
        if wanted is not None:
            met = sum(int(np.sum(line.error_estimate <= wanted)) for line in self.lines)
            reached = f" {met} of {motions} reached an error of {100.0 * wanted:g} %."
            if met < self.points:
                reached += f" {_MORE_EXACT[self.request.method]}"
        return (
            f"{branches} ({isolated} isolated), {motions} in "
            f"{self.elapsed_s:.1f} s; error relative to the fundamental of p: {self.largest_error:.1g} "
            f"(median of the worst branch), {worst:.1g} (worst point).{reached}{over}"
        )

    @property
    def holdable(self) -> tuple[NDArray[np.bool_], ...] | None:
        """Flags of motions that the bench can hold, one array per branch; None if no loop time is given."""
        least_s = self.least_growth_time_s
        return None if least_s is None else tuple(line.growth_time_s >= least_s for line in self.lines)

    @property
    def holding_sentence(self) -> str:
        """Return a sentence on the unstable motions that the bench can hold; empty without a loop time."""
        holdable = self.holdable
        if not holdable:
            return ""
        is_unstable = [line.is_unstable for line in self.lines]
        count = sum(int(each.sum()) for each in is_unstable)
        held = sum(int((a & b).sum()) for a, b in zip(is_unstable, holdable, strict=True))
        quickest = min(float(line.growth_time_s.min()) for line in self.lines)
        text = (
            f"A control loop with {self.request.loop_time_s:.3g} s delay can hold motions whose deviations "
            f"take {self.least_growth_time_s:.3g} s or more to grow e-fold: {held} of {count} unstable ones"
        )
        return text + (f"; the fastest e-fold growth takes {quickest:.2g} s." if count else ".")

    @property
    def least_growth_time_s(self) -> float | None:
        """Shortest e-folding time [s] of a motion that the bench can hold; None if no loop time is given."""
        loop_s = self.request.loop_time_s
        return None if loop_s is None else least_growth_time_s(loop_s)

    def curves(self) -> tuple[Curve, ...]:
        """Return curves of Responses I and II of m0 by stability; none if the amplitude varies."""
        if self.request.along is Parameter.AMPLITUDE:
            return ()
        found = []
        for origin in _ORIGINS:
            for kind, name in ((CurveKind.RESPONSE_I, "response_i"), (CurveKind.RESPONSE_II, "response_ii")):
                frequency_hz, size = self._join(name, origin)
                if frequency_hz.size:
                    unknown = np.full(frequency_hz.shape, np.nan)
                    note = self.cost_sentence
                    source = f"branches {self.request.title}"
                    found.append(Curve(source, origin, kind, frequency_hz, size, unknown, note))
        return tuple(found)

    def _join(self, name: str, origin: CurveOrigin) -> tuple[Reals, Reals]:
        """Join all stretches of the same stability into one curve, with NaN between the stretches."""
        found = [(line, piece) for line in self.lines for sort, piece in line.pieces() if sort is origin]
        if not found:
            return np.zeros(0), np.zeros(0)
        places = [np.append(line.frequency_hz[piece], line.frequency_hz[piece][-1]) for line, piece in found]
        sizes = [np.append(getattr(line, name)[piece, 0], np.nan) for line, piece in found]
        return np.concatenate(places)[:-1], np.concatenate(sizes)[:-1]


def branch_lines(request: BranchRequest) -> Iterator[BranchLine]:
    """Compute the branches of a request, and yield them one by one."""
    where = request.chosen_specimen, request.path, request.start, request.stop
    if request.resonance_band_hz is not None:
        found = _resonance(request, request.resonance_band_hz)
    elif request.method is BranchMethod.SHOOTING:
        found = shoot_branches(*where, request.search)
    else:
        found = balance_branches(*where, request.balance_options, request.search)
    return (line_of(each) for each in found)


def _resonance(request: BranchRequest, band_hz: tuple[float, float]) -> Iterator[FoundBranch]:
    began = time.perf_counter()
    levels_m = request.start, request.stop
    branch = phase_resonance_branch(request.chosen_specimen, band_hz, levels_m, request.phase_of)
    origin, elapsed_s = BranchOrigin.PHASE_RESONANCE, time.perf_counter() - began
    yield FoundBranch(branch, OrbitShape.MIRRORED, 1, origin, has_twin=False, elapsed_s=elapsed_s)


def diagram_of(request: BranchRequest) -> BranchDiagram:
    """Compute all branches of a request."""
    began = time.perf_counter()
    lines = tuple(branch_lines(request))
    return BranchDiagram(request, lines, time.perf_counter() - began)
