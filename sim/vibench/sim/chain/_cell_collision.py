"""A whole Hertz collision of one cell in one, by the method of `vibench.sim.collision`. SI units.

What a collision there knows of its specimen is a series of p without force, and what an impulse makes of p.
Both are at hand for a cell, however long its chain.
"""

from ..collision import (
    FORCE,
    Collision,
    CollisionTables,
    deepest_of,
    depth_of_fresh,
    find_collision,
)
from ..contact import ARGUMENT, DEEPEST, gap_of
from ..engine import POINTS, TERMS
from ..flight import P
from ..kernels import Table, Vector, eight_of_sixteen, inlined, kernel_without_refcount, store
from ._cell_contact import SUMMARY_ONLY, log_moment, motion_in_series
from ._cell_flow import (
    MEMORY,
    MOMENT,
    RATE,
    ROOT,
    ROOT_SCALE,
    SIDE,
    CellLaw,
    age_moments,
    write_aged,
)


@inlined
def is_hertz(law: CellLaw) -> bool:
    """Say whether the law is one whose collisions are known beforehand."""
    return law.contact_stiffness > 0.0 and law.linear_stiffness == 0.0 and law.loss == 0.0


@kernel_without_refcount
def collide_cell(
    cell: Vector,
    tau: float,
    longest: float,
    later: Vector,
    series: Vector,
    markov: Vector,
    law: CellLaw,
    tolerance: float,
    collision: Collision,
    known: CollisionTables,
    struck: Table,
    work: Table,
    log: Table,
) -> float:
    """Carry a cell that has just begun a contact to its end; gives the time that took, or zero: not done.

    Parameters
    ----------
    cell, series, markov, law, tolerance, work, log
        As in `vibench.sim.chain.press_cell`.
    tau, longest
        Time now since the window began, and how long the collision may last [s].
    later
        p without force from now on, in powers of the time from now on.
    collision, known, struck
        Memory, and numbers of collisions; what an impulse in this cell makes of its p.

    """
    collisions = CollisionTables(
        known.fastest,
        struck,
        known.shares,
        known.ends,
        known.heights,
        known.shapes,
        known.durations,
        known.about_middle,
    )
    side, speed = cell[SIDE], cell[RATE]
    deepest = depth_of_fresh(cell[ROOT], cell[ROOT_SCALE], speed, longest, tolerance, collisions)
    if deepest == 0.0:
        return 0.0
    # At a touch p is the gap but for rounding, and is taken for it.
    gap, scale = gap_of(side, law.lower, law.upper), side
    collision.motion[P] = gap
    for term in range(TERMS):
        collision.course[term] = scale * later[term]
        scale /= collisions.fastest
    duration = find_collision(
        collision, speed, deepest, longest, tolerance, law.contact_stiffness, gap, collisions
    )
    if duration == 0.0:
        return 0.0
    if len(log) > SUMMARY_ONLY:
        _log_points(cell, tau, duration, collision, collisions, work, log)
    if len(log) > 0:
        log[0, DEEPEST] = deepest_of(log[0, DEEPEST], collision, gap, collisions)
    age_moments(cell, duration)
    store(collision.course, 0, eight_of_sixteen(collisions.ends, 0, collision.workspace[FORCE]))
    factor = side
    for term in range(TERMS):
        factor *= duration / max(term, 1)
        cell[MEMORY + term] += factor * collision.course[term]
    p, rate = motion_in_series(cell[MEMORY:], series, markov, tau + duration)
    cell[MEMORY + 1] += (p - side * gap) / markov[1]
    p, rate = motion_in_series(cell[MEMORY:], series, markov, tau + duration)
    cell[ROOT], cell[RATE], cell[SIDE] = 0.0, side * rate, 0.0
    return duration


@kernel_without_refcount
def _log_points(
    cell: Vector,
    tau: float,
    duration: float,
    collision: Collision,
    collisions: CollisionTables,
    work: Table,
    log: Table,
) -> None:
    """Log the motion at the points of a collision."""
    node, force = work[ARGUMENT], collision.workspace[FORCE]
    for point in range(POINTS):
        passed, factor = duration * collisions.heights[point], cell[SIDE]
        write_aged(node, cell, tau, passed)
        for term in range(TERMS):
            factor *= duration / max(term, 1)
            pushed = 0.0
            for k in range(POINTS):
                pushed += collisions.shares[term, k, point] * force[k]
            node[MOMENT + term] += factor * pushed
        log_moment(log, node)
