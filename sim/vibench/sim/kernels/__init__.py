"""What compiled code is made of: compilation, vectors in registers, sums of phasors, elimination.

`compiled`, `lean` and `inlined` are the three ways to compile a function with numba (docs/decisions:
0018-first-use.md, 0027-numbers-in-registers.md); the cache on disk is keyed by all sources of the package.
Also: SIMD vectors of eight or sixteen numbers, a clock of two doubles (Dekker 1971), sums of turning and
decaying terms, elimination, Gram-Schmidt (the QR step of Lyapunov exponents), names of array types. Nothing
here knows what is simulated.
"""

from ._arrays import (
    Complex,
    Floats,
    Table,
    Vector,
)
from ._clock import (
    advance_clock,
    angle_at,
    clock_at,
    time_until,
)
from ._compile import (
    SOURCES,
    compiled,
    inlined,
    lean,
)
from ._elimination import (
    solve_in_place,
)
from ._orthonormal import (
    dot,
    orthonormal_rows,
    orthonormalise,
)
from ._phasor_sum import (
    AHEAD,
    fill_series,
    march,
    series_rows,
    steps_ahead,
    sum_now,
    turn_by,
)
from ._row import (
    copy_row,
)
from ._simd import (
    Lanes,
    eight,
    eight_of_eight,
    eight_of_sixteen,
    eights,
    largest,
    root,
    sixteen,
    sixteen_of_sixteen,
    store,
    total,
)

__all__ = [
    "AHEAD",
    "SOURCES",
    "Complex",
    "Floats",
    "Lanes",
    "Table",
    "Vector",
    "advance_clock",
    "angle_at",
    "clock_at",
    "compiled",
    "copy_row",
    "dot",
    "eight",
    "eight_of_eight",
    "eight_of_sixteen",
    "eights",
    "fill_series",
    "inlined",
    "largest",
    "lean",
    "march",
    "orthonormal_rows",
    "orthonormalise",
    "root",
    "series_rows",
    "sixteen",
    "sixteen_of_sixteen",
    "solve_in_place",
    "steps_ahead",
    "store",
    "sum_now",
    "time_until",
    "total",
    "turn_by",
]
