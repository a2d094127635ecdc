from ._arrays import (
    Complex as Complex,
    Counts as Counts,
    Floats as Floats,
    Table as Table,
    Vector as Vector,
)
from ._clock import (
    advance_clock as advance_clock,
    angle_at as angle_at,
    clock_at as clock_at,
    time_until as time_until,
)
from ._compile import (
    inlined as inlined,
    kernel as kernel,
    kernel_without_refcount as kernel_without_refcount,
)
from ._row import (
    copy_row as copy_row,
)
from ._simd import (
    SimdVector as SimdVector,
    eight as eight,
    eight_of_eight as eight_of_eight,
    eight_of_sixteen as eight_of_sixteen,
    eights as eights,
    largest as largest,
    root as root,
    sixteen as sixteen,
    sixteen_of_sixteen as sixteen_of_sixteen,
    store as store,
    total as total,
)
