"""What is observed of a chain while it runs: the largest motions, and the forces' lines. SI units.

The largest motions are extremes of the motion itself, not of samples. The lines of all displacements follow
from those of the forces in the cells by the equations of motion (`vibench.sim.chain`), so that
only the latter are summed.
"""

from typing import NamedTuple

from ..contact import DEEPEST, LOGGED, hermite_peak
from ..flight import series_peak
from ..kernels import Complex, Table, Vector, inlined, kernel_without_refcount
from ._cell_contact import PUSHED, SUMMARY_ONLY, motion_in_series
from ._cell_flow import MEMORY, MOMENT, MOMENTS, POWER, T
from ._tables import ACROSS, KIND, LOWER, OBSERVED, PATH, UPPER, ChainTables
from ._windows import Workspace, fill_observed

NOTHING, PEAKS, PEAKS_AND_LINES = range(3)
"""What a tally's mode asks for."""


class ChainObservations(NamedTuple):
    """Sums of a run."""

    mode: int
    peaks: Table
    """Largest abs of p and x of every cell, shape (2, cells) [m]."""
    forces: Complex
    """Integral of each cell's force against exp(-i (omega t + phase)), shape (cells,) [N s]."""


@kernel_without_refcount
def observe_forces(
    observations: ChainObservations, cell: Vector, place: int, end: complex, omega: float
) -> None:
    """Add the moments of a window's force; ``end`` is the drive's term at the window's end."""
    total = complex(0.0, 0.0)
    for k in range(MOMENTS - 1, -1, -1):
        total = total * complex(0.0, omega) + cell[MEMORY + k]
    observations.forces[place] += end.conjugate() * total


@inlined
def _bound_without_force(workspace: Workspace, what: int, place: int, length: float) -> float:
    """Bound the magnitude of p or x of a cell over a window in which no force acts."""
    at_ends = max(abs(workspace.motion[what, place]), abs(workspace.motion_end[what, place]))
    bound: float = at_ends + workspace.curvature[what, place] * length * length / 8.0
    return bound


@kernel_without_refcount
def observe_idle(
    observations: ChainObservations,
    place: int,
    workspace: Workspace,
    phasors: Complex,
    length: float,
    tables: ChainTables,
) -> None:
    """Look for larger motions of a cell without a force.

    A window is looked at only if the bounds let it hold a larger value than the largest so far.
    """
    series = workspace.watched
    for what in range(OBSERVED):
        best = observations.peaks[what, place]
        if _bound_without_force(workspace, what, place, length) > best:
            fill_observed(series, phasors, place, what, workspace.terms, workspace.force, tables)
            observations.peaks[what, place] = series_peak(best, series, 0.0, length)


@kernel_without_refcount
def may_be_larger(
    observations: ChainObservations,
    place: int,
    workspace: Workspace,
    length: float,
    summary: Vector,
    tables: ChainTables,
) -> bool:
    """Say whether p or x of a busy cell may be larger in its window than ever, as far as its summary tells.

    Between stops p is nowhere larger than at a stop. The force changes p and x by no more than an impulse as
    large as the variation of its integral would, given when the window begins.
    """
    law, best = tables.laws[place], observations.peaks[PATH, place]
    if law[KIND] == POWER and summary[DEEPEST] > best:
        return True
    is_known = law[KIND] == POWER or max(summary[DEEPEST], best) >= max(law[LOWER], law[UPPER])
    for what in range(ACROSS if is_known else PATH, OBSERVED):
        share, bound = summary[PUSHED], _bound_without_force(workspace, what, place, length)
        for k in range(1, MOMENTS + 1):
            share *= length / k
            bound += abs(tables.markov[place, what, k]) * share
        if bound > observations.peaks[what, place]:
            return True
    return False


@kernel_without_refcount
def observe_busy(
    observations: ChainObservations,
    place: int,
    workspace: Workspace,
    phasors: Complex,
    log: Table,
    tables: ChainTables,
) -> None:
    """Look for larger motions of a cell between the logged instants of its window; a summary has none."""
    largest = max(observations.peaks[PATH, place], abs(workspace.motion[PATH, place]))
    if tables.laws[place, KIND] != POWER:
        largest = max(largest, log[0, DEEPEST])
    observations.peaks[PATH, place] = largest
    for what in range(OBSERVED if len(log) > SUMMARY_ONLY else 0):
        series, markov, best = workspace.watched, tables.markov[place, what], observations.peaks[what, place]
        fill_observed(series, phasors, place, what, workspace.terms, workspace.force, tables)
        value, slope = motion_in_series(log[1, MOMENT:], series, markov, log[1, T])
        for row in range(2, int(log[0, LOGGED]) + 1):
            step = log[row, T] - log[row - 1, T]
            value_end, slope_end = motion_in_series(log[row, MOMENT:], series, markov, log[row, T])
            best = hermite_peak(best, value, slope, value_end, slope_end, step)
            value, slope = value_end, slope_end
        observations.peaks[what, place] = best
