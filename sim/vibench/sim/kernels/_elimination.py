"""Linear equations with several right-hand sides, for kernels. SI units."""

from ._arrays import Table
from ._compile import kernel_without_refcount


@kernel_without_refcount
def solve_in_place(equations: Table, size: int, columns: int) -> None:
    """Put the answers in the place of the right-hand sides, by elimination with row exchange.

    Matrix and right-hand sides stand side by side; ``columns`` counts both.
    """
    for k in range(size):
        best = k
        for i in range(k + 1, size):
            if abs(equations[i, k]) > abs(equations[best, k]):
                best = i
        for j in range(k, columns):
            equations[k, j], equations[best, j] = equations[best, j], equations[k, j]
        for i in range(k + 1, size):
            part = equations[i, k] / equations[k, k]
            for j in range(k + 1, columns):
                equations[i, j] -= part * equations[k, j]
    for k in range(size - 1, -1, -1):
        for j in range(size, columns):
            found = equations[k, j]
            for i in range(k + 1, size):
                found -= equations[k, i] * equations[i, j]
            equations[k, j] = found / equations[k, k]
