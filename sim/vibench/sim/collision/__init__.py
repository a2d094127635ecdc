"""A whole Hertz collision in one: depths at sixteen Gauss points and the duration, by Newton's method.

Measured by their own depth and time, collisions differ only by how hard the other springs press: the
shapes, and how they answer a misfit, are tabulated by that and then corrected
(docs/decisions/0008-speed-of-contacts.md). Where a few corrections do not suffice (next to no speed,
springs as fast as the collision, an instant to stop at in the midst of it) nothing is done here, and
`contact` resolves it in steps. Peaks, lines and the variation follow from the sixteen points.
"""

from ._collision import (
    Collision,
    collide,
    new_collision,
)
from ._observer import (
    observe_collision,
)
from ._tables import (
    CollisionTables,
    collision_tables,
)
from ._variation import (
    collision_memory,
    propagate_tangent_collision,
)

__all__ = [
    "Collision",
    "CollisionTables",
    "collide",
    "collision_memory",
    "collision_tables",
    "new_collision",
    "observe_collision",
    "propagate_tangent_collision",
]
