"""A run of a chain, window by window. SI units.

In a window every cell moves as if the others were free: its own force acts on it with nothing left out,
another's only from the window's end on. What this leaves out is bounded when the windows are chosen
(`vibench.sim.chain`), so that simultaneous contacts need no common time: each is followed in its own.
"""

import numpy as np

from ..kernels import (
    Complex,
    Table,
    Vector,
    advance_clock,
    inlined,
    kernel,
    kernel_without_refcount,
    time_until,
)
from ..model import Outcome
from ._base_force import place_force
from ._cell_flow import CELL_SIZE, POWER, SIDE
from ._cell_window import COUNT, CUT
from ._crossing import (
    IMPACTS,
    NEXT_SAMPLE,
    REACHED_END,
    ChainRecord,
    cross,
    prepare_busy,
    sample_window,
)
from ._observer import (
    NOTHING,
    PEAKS_AND_LINES,
    ChainObservations,
    observe_forces,
    observe_idle,
)
from ._tables import KIND, LOWER, OBSERVED, PATH, UPPER, ChainTables
from ._windows import (
    Workspace,
    copy_motion,
    copy_terms,
    deposit,
    drive_term,
    find_busy,
    is_bounded,
    march,
    neighbours_clash,
    place_observed,
    propagate_window,
    set_ceilings,
    weigh,
    workspace_for,
)

LOST = int(Outcome.NOT_FINITE)


@kernel
def advance_chain(
    cells: Table,
    phasors: Complex,
    clock: Vector,
    until: float,
    tables: ChainTables,
    tolerance: float,
    record: ChainRecord,
    observations: ChainObservations,
) -> int:
    """Advance cells, phasors and clock in place to the instant ``until`` [s]; returns an `Outcome` code."""
    return _advance(
        workspace_for(tables), cells, phasors, clock, until, tables, tolerance, record, observations
    )


@kernel_without_refcount
def _advance(  # noqa: C901, PLR0912 - the kinds of window and their ends are one loop
    workspace: Workspace,
    cells: Table,
    phasors: Complex,
    clock: Vector,
    until: float,
    tables: ChainTables,
    tolerance: float,
    record: ChainRecord,
    observations: ChainObservations,
) -> int:
    observed = 1 if observations.mode == NOTHING else OBSERVED
    count, drive = len(cells), len(phasors) - 1
    phasors[drive] = drive_term(clock, 0.0, tables)
    while True:
        left = longest = time_until(clock, until)
        if left <= 0.0:
            return REACHED_END
        if len(tables.pieces) > 0:
            longest = min(left, place_force(workspace.force, clock, tables))
        if count > 0 or len(tables.pieces) > 0:
            # A force has acted: what was known of the paths to come is void.
            place_observed(workspace.motion, phasors, observed, tables)
            weigh(workspace, phasors, observed, tables)
            if is_bounded(workspace) == 0:
                return LOST
            if len(tables.pieces) == 0 and is_quiet(workspace, cells, tables) == 1:
                _go_quietly(workspace, phasors, cells, clock, until, tables, tolerance, record, observations)
                return REACHED_END
        if (
            len(tables.pieces) == 0
            and _march_on(workspace, phasors, cells, clock, longest, observations, record, tables) > 0
        ):
            count = 0
            continue
        length, count = _choose_window(workspace, cells, phasors, clock, longest, observed, tables)
        prepare_busy(workspace, cells, phasors, count, length, tables)
        code, impacts = CUT, record.counts[IMPACTS]
        while code == CUT:
            record.counts[IMPACTS] = impacts
            code = cross(
                workspace, cells, phasors, count, length, clock, tables, tolerance, record, observations
            )
            if code == CUT:
                length = workspace.touches[COUNT]
                propagate_window(workspace, phasors, clock, length, 0, tables)
                place_observed(workspace.motion_end, workspace.turned, observed, tables)
        if observations.mode != NOTHING:
            _observe_rest(workspace, cells, phasors, count, length, tables, observations)
        if record.counts[NEXT_SAMPLE] < len(record.samples):
            sample_window(workspace, phasors, clock, length, tables, tolerance, record)
        for k in range(count):
            deposit(workspace.turned, cells[workspace.busy[k]], workspace.busy[k], tables)
        copy_terms(phasors, workspace.turned)
        copy_motion(workspace.motion, workspace.motion_end, observed)
        if length >= left:
            clock[0], clock[1] = until, 0.0
        else:
            advance_clock(clock, length)
        if code != REACHED_END:
            return code


@kernel_without_refcount
def _go_quietly(
    workspace: Workspace,
    phasors: Complex,
    cells: Table,
    clock: Vector,
    until: float,
    tables: ChainTables,
    tolerance: float,
    record: ChainRecord,
    observations: ChainObservations,
) -> None:
    """Go to the end in one step when no cell can ever touch; who watches looks at every window."""
    longest, drive = time_until(clock, until), len(phasors) - 1
    workspace.busy_count[0] = 0
    copy_terms(workspace.start, phasors)
    if record.counts[NEXT_SAMPLE] < len(record.samples):
        sample_window(workspace, phasors, clock, longest, tables, tolerance, record)
    if observations.mode != NOTHING:
        then = workspace.then
        then[0], then[1] = clock[0], clock[1]
        left = longest
        while left > 0.0:
            if _march_on(workspace, phasors, cells, then, left, observations, record, tables) == 0:
                length = min(left, tables.windows[0])
                propagate_window(workspace, phasors, then, length, 0, tables)
                place_observed(workspace.motion_end, workspace.turned, OBSERVED, tables)
                for i in range(len(cells)):
                    observe_idle(observations, i, workspace, phasors, length, tables)
                copy_terms(phasors, workspace.turned)
                copy_motion(workspace.motion, workspace.motion_end, OBSERVED)
                advance_clock(then, length)
            left = time_until(then, until)
    for j in range(drive):
        phasors[j] = workspace.start[j] * np.exp(tables.rates[j] * longest)
    clock[0], clock[1] = until, 0.0
    phasors[drive] = drive_term(clock, 0.0, tables)


@inlined
def _march_on(
    workspace: Workspace,
    phasors: Complex,
    cells: Table,
    clock: Vector,
    longest: float,
    observations: ChainObservations,
    record: ChainRecord,
    tables: ChainTables,
) -> int:
    """Advance over whole windows in which nothing can happen; gives how many there were."""
    observed = 1 if observations.mode == NOTHING else OBSERVED
    for i in range(len(cells)):
        if cells[i, SIDE] != 0.0:
            return 0
    window, free = tables.windows[0], longest
    if record.counts[NEXT_SAMPLE] < len(record.samples):
        free = min(free, time_until(clock, record.start + record.counts[NEXT_SAMPLE] / record.sample_rate))
    # One window less than fits: the last one before an instant is cut to end on it.
    steps = int(free / window) - 1
    if steps <= 0:
        return 0
    set_ceilings(workspace, observations.peaks, observed, window, tables)
    for what in range(observed):
        for i in range(len(cells)):
            if not workspace.floor[what, i] < workspace.motion[what, i] < workspace.ceiling[what, i]:
                return 0
    return march(workspace, phasors, clock, observed, steps, tables)


@inlined
def _choose_window(
    workspace: Workspace,
    cells: Table,
    phasors: Complex,
    clock: Vector,
    longest: float,
    observed: int,
    tables: ChainTables,
) -> tuple[float, int]:
    """Take the longest window in which no two busy cells feel each other, and turn the phasors to its end.

    Gives its length [s], and how many cells are busy.
    """
    length, count = longest, 0
    for level in range(len(tables.windows)):
        length = min(longest, tables.windows[level])
        propagate_window(workspace, phasors, clock, length, level, tables)
        place_observed(workspace.motion_end, workspace.turned, observed, tables)
        count = find_busy(workspace, cells, length, tables)
        if neighbours_clash(workspace.busy, count, tables.clash[level]) == 0:
            break
    return length, count


@inlined
def is_quiet(workspace: Workspace, cells: Table, tables: ChainTables) -> int:
    """Say (1 or 0) whether no cell can ever touch: free phasors only shrink."""
    for i in range(len(cells)):
        law = tables.laws[i]
        if (
            cells[i, SIDE] != 0.0
            or law[KIND] == POWER
            or workspace.reach[PATH, i] >= min(law[LOWER], law[UPPER])
        ):
            return 0
    return 1


@kernel_without_refcount
def _observe_rest(
    workspace: Workspace,
    cells: Table,
    phasors: Complex,
    count: int,
    length: float,
    tables: ChainTables,
    observations: ChainObservations,
) -> None:
    """Observe the cells without a force in the window, and add the forces of the others."""
    busy = 0
    for i in range(len(cells)):
        if busy == count or workspace.busy[busy] != i:
            observe_idle(observations, i, workspace, phasors, length, tables)
            continue
        busy += 1
        if observations.mode == PEAKS_AND_LINES:
            observe_forces(observations, cells[i], i, workspace.turned[len(phasors) - 1], tables.omega)


@kernel
def chain_cells(count: int) -> Table:
    """Make the rows of cells in flight."""
    return np.zeros((count, CELL_SIZE))
