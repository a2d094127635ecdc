"""Rows of numbers, copied place by place. SI units."""

from .arrays import Complex, Vector
from .compile import inlined


@inlined
def copy_row(target: Vector | Complex, source: Vector | Complex) -> None:
    """Write as many numbers as ``target`` has.

    A slice's assignment would be compiled together with all its complaints: two seconds at first use.
    """
    for place in range(len(target)):
        target[place] = source[place]
