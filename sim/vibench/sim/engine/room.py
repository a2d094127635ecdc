"""The memory of one run between stops, made once and handed to every kernel. SI units."""

from typing import NamedTuple

import numpy as np

from ..growth.tangent_collision import collision_memory
from ..growth.tangent_contact import tangent_workspace
from ..modes import Complex
from .collision import Collision, new_collision
from .contact import contact_workspace, log_for
from .contact_flow import FORCE_TERMS
from .parameters import STATE_SIZE, Table, Vector
from .turning import AHEAD


class Room(NamedTuple):
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


def room_for(terms: int, tally: Vector, tangent: Table | None) -> Room:
    """Make the memory of a run whose flights have so many terms."""
    return Room(
        np.zeros(terms, np.complex128),
        np.zeros(terms, np.complex128),
        np.zeros(terms, np.complex128),
        np.zeros(terms, np.complex128),
        np.zeros(AHEAD),
        np.zeros(FORCE_TERMS),
        contact_workspace(),
        np.zeros(STATE_SIZE),
        log_for(tally, tangent),
        tangent_workspace(),
        new_collision(),
        collision_memory(),
    )
