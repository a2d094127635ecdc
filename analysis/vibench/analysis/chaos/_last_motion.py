"""Where in a record its last motion begins: chaos may be a transient that ends in the middle of a dwell."""

from itertools import pairwise

import numpy as np

from ._period import Points, shortest_period

_BLOCKS = 10
_SHORTEST_BLOCK = 50
"""Drive periods that say whether a motion repeats."""


def begin_of_last_motion(points: Points) -> int:
    """Give the index of the first point of the motion that a record ends in; 0 where it never changes.

    A record is cut into blocks, each of which repeats itself within its noise or does not. One change from
    the one to the other is a transient that has ended, or a motion that was lost. More than one are chaos
    with calm stretches, and belong to one motion.
    """
    count = len(points.value)
    edges = np.linspace(0, count, max(min(_BLOCKS, count // _SHORTEST_BLOCK), 1) + 1).astype(int)
    repeats = np.array(
        [
            shortest_period(Points(points.value[first:stop], points.noise)) is not None
            for first, stop in pairwise(edges)
        ]
    )
    changes = np.flatnonzero(repeats[1:] != repeats[:-1])
    if changes.size != 1:
        return 0
    # The block in which it changes does not repeat: a motion that is lost begins somewhere inside it.
    last = int(changes[0]) + 1
    return int(edges[last] if repeats[-1] else edges[min(last + 1, len(edges) - 1)])
