"""One way to compile a kernel, typed so that a checker still sees the function underneath."""

from collections.abc import Callable
from typing import TypeVar, cast

from numba import njit

Kernel = TypeVar("Kernel", bound=Callable[..., object])


def compiled(kernel: Kernel) -> Kernel:
    """Compile with numba: cached on disk, without the interpreter lock, IEEE division.

    ``error_model="numpy"`` divides as the processor does (x/0 is inf): kernels guard their own
    denominators and must not raise. ``fastmath`` stays off: it may assume that no NaN exists,
    and the step control must see one.
    """
    return cast("Kernel", njit(cache=True, nogil=True, error_model="numpy")(kernel))
