"""The memory of one run between stops, made once and handed to every kernel. SI units."""

from typing import NamedTuple

import numpy as np

from ..collision import Collision, collision_memory, new_collision
from ..contact import contact_workspace, log_for, tangent_workspace
from ..flight import FORCE_TERMS
from ..kernels import STEPS_AHEAD, Complex, Table, Vector
from ..slots import STATE_SIZE


class Workspace(NamedTuple):
    """Workspaces of a run."""

    phasors: Complex
    now: Complex
    landed: Complex
    terms: Complex
    series: Vector
    force: Vector
    work: Table
    shadow: Vector
    log: Table
    memory: Table
    collision: Collision
    equations: Table


def workspace_for(terms: int, observations: Vector, tangent: Table | None) -> Workspace:
    """Make the memory of a run whose flights have so many terms."""
    return Workspace(
        np.zeros(terms, np.complex128),
        np.zeros(terms, np.complex128),
        np.zeros(terms, np.complex128),
        np.zeros(terms, np.complex128),
        np.zeros(STEPS_AHEAD),
        np.zeros(FORCE_TERMS),
        contact_workspace(),
        np.zeros(STATE_SIZE),
        log_for(observations, tangent),
        tangent_workspace(),
        new_collision(),
        collision_memory(),
    )
