"""Busy cells on their way through a window, each in its own time, and what is kept of it. SI units."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..contact import DEEPEST
from ..kernels import Complex, Table, Vector, copy_row, inlined, kernel_without_refcount, time_until
from ..model import Outcome
from ._base_force import deposit_base
from ._cell_contact import SUMMARY_ONLY
from ._cell_flow import CELL_SIZE, MEMORY, POWER
from ._cell_power import begin_power
from ._cell_window import COUNT, CUT, cross_window
from ._observer import NOTHING, ChainObservations, may_be_larger, observe_busy
from ._tables import PATH, ChainTables
from ._windows import Workspace, deposit, drive_term, fill_observed, law_of, place_motion

REACHED_END = int(Outcome.REACHED_END)
TOO_MANY_IMPACTS = int(Outcome.TOO_MANY_IMPACTS)

NEXT_SAMPLE, IMPACTS = 0, 1
"""Places of `ChainRecord.counts`."""


class ChainRecord(NamedTuple):
    """What a run fills on its way."""

    start: float
    """Time of sample 0 [s]."""
    sample_rate: float
    samples: Table
    """Shape (n, 6 cells); n = 0 keeps none."""
    impact_times: Vector
    """Shape (most impacts,) [s], ascending but within a window; a run ends in the window that fills it."""
    impact_cells: NDArray[np.int64]
    counts: NDArray[np.int64]
    """Samples and impacts so far."""


@inlined
def prepare_busy(
    workspace: Workspace, cells: Table, phasors: Complex, count: int, length: float, tables: ChainTables
) -> None:
    """Write p of busy cells as series, and their rows as the window begins."""
    for k in range(count):
        i = workspace.busy[k]
        cell, series, law = cells[i], workspace.series[i], law_of(tables.laws[i])
        fill_observed(series, phasors, i, PATH, workspace.terms, workspace.force, tables)
        for m in range(MEMORY, CELL_SIZE):
            cell[m] = 0.0
        if law.kind == POWER:
            begin_power(cell, series, length)
        copy_row(workspace.before[i], cell)


@inlined
def cross(
    workspace: Workspace,
    cells: Table,
    phasors: Complex,
    count: int,
    length: float,
    clock: Vector,
    tables: ChainTables,
    tolerance: float,
    record: ChainRecord,
    observations: ChainObservations,
) -> int:
    """Take every busy cell through the window; CUT where it is to be shorter, as ``touches`` then says.

    Who watches has a summary kept, and crosses again with a log where that leaves room for a larger motion.
    """
    worst = REACHED_END
    for k in range(count):
        i = workspace.busy[k]
        cell, series, markov = cells[i], workspace.series[i], tables.markov[i, PATH]
        log = workspace.no_log if observations.mode == NOTHING else workspace.summary
        while True:
            copy_row(cell, workspace.before[i])
            workspace.touches[COUNT] = 0.0
            if len(log) > 0:
                log[0, DEEPEST] = observations.peaks[PATH, i]
            code = cross_window(
                cell, 0.0, length, series, markov, workspace.reach[PATH, i], law_of(tables.laws[i]),
                tolerance, workspace.later, workspace.work, workspace.touches, log, tables.collision,
                tables.collisions, tables.struck[i], workspace.power, tables.cuts,
            )  # fmt: skip
            if (
                code != REACHED_END
                or len(log) != SUMMARY_ONLY
                or not may_be_larger(observations, i, workspace, length, log[0], tables)
            ):
                break
            log = workspace.log
        if code == CUT:
            worst = CUT
            break
        if code == REACHED_END:
            code = _record_touches(workspace.touches, i, clock, record)
        if observations.mode != NOTHING:
            observe_busy(observations, i, workspace, phasors, log, tables)
        worst = max(worst, code)
    return worst


@kernel_without_refcount
def _record_touches(touches: Vector, place: int, clock: Vector, record: ChainRecord) -> int:
    for k in range(1, int(touches[COUNT]) + 1):
        impact = record.counts[IMPACTS]
        if impact == len(record.impact_times):
            return TOO_MANY_IMPACTS
        record.impact_times[impact] = clock[0] + touches[k]
        record.impact_cells[impact] = place
        record.counts[IMPACTS] += 1
    return REACHED_END


@kernel_without_refcount
def sample_window(
    workspace: Workspace,
    phasors: Complex,
    clock: Vector,
    length: float,
    tables: ChainTables,
    tolerance: float,
    record: ChainRecord,
) -> None:
    """Keep the samples that fall into a window, by a second run of the busy cells that lands on each."""
    counts, reached, count = record.counts, 0.0, workspace.busy_count[0]
    drive = len(phasors) - 1
    while counts[NEXT_SAMPLE] < len(record.samples):
        later = time_until(clock, record.start + counts[NEXT_SAMPLE] / record.sample_rate)
        if later > length:
            return
        now = workspace.terms
        for j in range(drive):
            now[j] = phasors[j] * np.exp(tables.rates[j] * later)
        now[drive] = drive_term(clock, later, tables)
        deposit_base(now, workspace.force, later, tables)
        for k in range(count):
            i = workspace.busy[k]
            workspace.touches[COUNT] = 0.0
            if later > reached:
                cross_window(
                    workspace.before[i], reached, later, workspace.series[i], tables.markov[i, PATH],
                    workspace.reach[PATH, i], law_of(tables.laws[i]), tolerance,
                    workspace.later, workspace.work, workspace.touches, workspace.no_log,
                    tables.collision, tables.collisions, tables.struck[i], workspace.power, 0,
                )  # fmt: skip
            deposit(now, workspace.before[i], i, tables)
        reached = max(reached, later)
        place_motion(record.samples[counts[NEXT_SAMPLE]], now, tables)
        counts[NEXT_SAMPLE] += 1
