"""What is observed of a chain while it runs: the largest motions, and the forces' lines. SI units.

The largest motions are extremes of the motion itself, not of samples. The lines of all displacements follow
from those of the forces in the cells by the equations of motion (`vibench.sim.chain`), so that
only the latter are summed.
"""

from typing import NamedTuple

from ..contact import DEEPEST, LOGGED, hermite_peak
from ..flight import series_peak
from ..kernels import Complex, Table, Vector, kernel_without_refcount
from ._cell_contact import motion_in_series
from ._cell_flow import MEMORY, MOMENT, MOMENTS, T
from ._tables import OBSERVED, PATH, ChainTables
from ._windows import Workspace, fill_observed

NOTHING, PEAKS, PEAKS_AND_LINES = range(3)
"""What a tally's mode asks for."""


class ChainObservations(NamedTuple):
    """Sums of a run."""

    mode: int
    peaks: Table
    """Largest abs of p, x, y, z of every cell, shape (4, cells) [m]."""
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


@kernel_without_refcount
def observe_idle(
    observations: ChainObservations,
    place: int,
    workspace: Workspace,
    phasors: Complex,
    length: float,
    tables: ChainTables,
) -> None:
    """Look for larger motions of a cell without a force; its row of ``space.series`` is overwritten.

    A window is looked at only if the bounds let it hold a larger value than the largest so far.
    """
    series = workspace.series[place]
    is_filled = False
    for what in range(OBSERVED):
        at_ends = max(abs(workspace.motion[what, place]), abs(workspace.motion_end[what, place]))
        if (
            at_ends + workspace.curvature[what, place] * length * length / 8.0
            <= observations.peaks[what, place]
        ):
            continue
        if not is_filled:
            fill_observed(series, phasors, place, OBSERVED, workspace.terms, workspace.force, tables)
            is_filled = True
        observations.peaks[what, place] = series_peak(
            observations.peaks[what, place], series[what], 0.0, length
        )


@kernel_without_refcount
def observe_busy(
    observations: ChainObservations, place: int, series: Table, log: Table, tables: ChainTables
) -> None:
    """Look for larger motions of a cell between the logged instants of its window."""
    observations.peaks[PATH, place] = max(observations.peaks[PATH, place], log[0, DEEPEST])
    for what in range(OBSERVED):
        markov, best = tables.markov[place, what], observations.peaks[what, place]
        value, slope = motion_in_series(log[1, MOMENT:], series[what], markov, log[1, T])
        for row in range(2, int(log[0, LOGGED]) + 1):
            step = log[row, T] - log[row - 1, T]
            value_end, slope_end = motion_in_series(log[row, MOMENT:], series[what], markov, log[row, T])
            best = hermite_peak(best, value, slope, value_end, slope_end, step)
            value, slope = value_end, slope_end
        observations.peaks[what, place] = best
