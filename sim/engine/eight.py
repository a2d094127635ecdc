"""Eight numbers at once, which a processor keeps in one register or two. SI units.

Written out place by place: the compiler finds the vectors in that, in a loop over an array it must first
exclude that what is written is what is read.
"""

from ..compiled import inlined
from .parameters import Table, Vector

Eight = tuple[float, float, float, float, float, float, float, float]


@inlined
def all_eight(value: float) -> Eight:
    """Give the same number eight times."""
    return value, value, value, value, value, value, value, value


@inlined
def load(a: Vector) -> Eight:
    """Give the first eight numbers of an array."""
    return a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7]


@inlined
def load_row(table: Table, row: int) -> Eight:
    """Give the first eight numbers of a row."""
    return (
        table[row, 0],
        table[row, 1],
        table[row, 2],
        table[row, 3],
        table[row, 4],
        table[row, 5],
        table[row, 6],
        table[row, 7],
    )


@inlined
def store(a: Vector, v: Eight) -> None:
    """Write to the first eight places of an array."""
    a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7] = v


@inlined
def product(v: Eight, w: Eight) -> Eight:
    """Multiply place by place."""
    return (
        v[0] * w[0],
        v[1] * w[1],
        v[2] * w[2],
        v[3] * w[3],
        v[4] * w[4],
        v[5] * w[5],
        v[6] * w[6],
        v[7] * w[7],
    )


@inlined
def add_times(v: Eight, factor: float, w: Eight) -> Eight:
    """V + factor w."""
    return (
        v[0] + factor * w[0],
        v[1] + factor * w[1],
        v[2] + factor * w[2],
        v[3] + factor * w[3],
        v[4] + factor * w[4],
        v[5] + factor * w[5],
        v[6] + factor * w[6],
        v[7] + factor * w[7],
    )


@inlined
def largest_gap(v: Eight, w: Eight) -> float:
    """Largest abs(v - w); pairwise, so that no comparison waits for all before it."""
    a = max(abs(v[0] - w[0]), abs(v[1] - w[1]))
    b = max(abs(v[2] - w[2]), abs(v[3] - w[3]))
    c = max(abs(v[4] - w[4]), abs(v[5] - w[5]))
    d = max(abs(v[6] - w[6]), abs(v[7] - w[7]))
    e, f = max(a, b), max(c, d)
    return max(e, f)


@inlined
def total(v: Eight) -> float:
    """Sum of all eight."""
    return ((v[0] + v[1]) + (v[2] + v[3])) + ((v[4] + v[5]) + (v[6] + v[7]))


@inlined
def add_rows(start: Eight, weights: Eight, table: Table, first: int) -> Eight:
    """Add eight rows of a table from ``first`` on, each with its weight, to ``start``."""
    v = add_times(start, weights[0], load_row(table, first))
    v = add_times(v, weights[1], load_row(table, first + 1))
    v = add_times(v, weights[2], load_row(table, first + 2))
    v = add_times(v, weights[3], load_row(table, first + 3))
    v = add_times(v, weights[4], load_row(table, first + 4))
    v = add_times(v, weights[5], load_row(table, first + 5))
    v = add_times(v, weights[6], load_row(table, first + 6))
    return add_times(v, weights[7], load_row(table, first + 7))
