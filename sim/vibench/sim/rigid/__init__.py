"""Impact on a rigid stop: m1 rebounds with a coefficient of restitution (Newton), or comes to rest on it.

An impact takes no time and keeps the momentum of m1 and m2. Chatter, infinitely many impacts in a finite
time, is followed while it can be told from rest and then summed; m1 is held from then on (`sticking`). The
variation of an impact is Mueller's correction, the saltation matrix (Leine and Nijmeijer 2004, section
7.3); none at grazing.
"""

from ._stop import (
    RESOLVED,
    closed_gap,
    is_resolved,
    place_between_rigid_stops,
    rebound,
)
from ._variation import (
    propagate_tangent_impact,
)

__all__ = [
    "RESOLVED",
    "closed_gap",
    "is_resolved",
    "place_between_rigid_stops",
    "propagate_tangent_impact",
    "rebound",
]
