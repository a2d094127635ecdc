from ._collision import (
    Collision as Collision,
    collide as collide,
    new_collision as new_collision,
)
from ._observer import (
    observe_collision as observe_collision,
)
from ._tables import (
    CollisionTables as CollisionTables,
    collision_tables as collision_tables,
)
from ._variation import (
    collision_memory as collision_memory,
    propagate_tangent_collision as propagate_tangent_collision,
)
