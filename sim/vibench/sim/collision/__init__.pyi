<<<<<<< HEAD
from ._fit import (
    COUNTS as COUNTS,
    DERIVATIVES as DERIVATIVES,
    LEAST_TOLERANCE as LEAST_TOLERANCE,
    LENGTH as LENGTH,
    MIDDLE as MIDDLE,
    MOMENTS as MOMENTS,
    POLYNOMIALS as POLYNOMIALS,
    PRODUCTS as PRODUCTS,
    PUSHES as PUSHES,
    VARIABLES as VARIABLES,
    CollisionFit as CollisionFit,
    fit_collisions as fit_collisions,
    time_over_fifth_root as time_over_fifth_root,
=======
from ._collision import (
    FORCE as FORCE,
    FRESH as FRESH,
    LEAST_TOLERANCE as LEAST_TOLERANCE,
    LONGEST as LONGEST,
    Collision as Collision,
    depth_of_fresh as depth_of_fresh,
    find_collision as find_collision,
    new_collision as new_collision,
)
from ._observer import (
    deepest_of as deepest_of,
)
from ._tables import (
    CollisionTables as CollisionTables,
    collisions_in_a_course as collisions_in_a_course,
>>>>>>> d05a509c (Follow batches of motions in native code)
)
