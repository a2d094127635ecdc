"""What a scene costs, without what a process pays once: the compilation of its kernels."""

import math
import time
from collections.abc import Callable

from ..scene import Prediction, Scene
from ._executor import Solved

Solver = Callable[[Scene], Prediction]
Kind = tuple[object, ...]

_solved_before: set[Kind] = set()
"""Kinds of scenes whose kernels this process has compiled."""


def solve_timed(scene: Scene, solver: Solver) -> Solved:
    """Solve one scene, and say what it cost this thread.

    A scene that begins before one of its kind has ended may have compiled kernels, or waited for them: its
    time says nothing.
    """
    kind: Kind = (type(scene.specimen.contact), scene.observe, type(scene.duration))
    is_compiled = kind in _solved_before
    start_s = time.thread_time()
    prediction = solver(scene)
    taken_s = time.thread_time() - start_s
    _solved_before.add(kind)
    return Solved(prediction, taken_s if is_compiled else math.nan)
