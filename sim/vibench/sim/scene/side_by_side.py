"""Scenes that are solved beside others, as long as states alone are followed. SI units."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from .pace import FEWEST_TIMES
from .prediction import ScenePrediction
from .scene import Scene
from .several_starts import FEWEST
from .solve import settling_scene, solving_scene
from .states_alone import REMEMBERED, Asking, Following, follow_all

MOST_HELD = 2e7
"""States of scenes that are solved together, about: a gigabyte."""


@dataclass(frozen=True, eq=False)
class Solved:
    """What a scene came to that was solved beside others."""

    prediction: ScenePrediction
    taken_s: float
    """Processor time of this thread for it [s]; of what was followed together, its part. NaN when what a
    process pays once was part of it."""


def solve_scenes(scenes: Sequence[Scene]) -> list[Solved]:
    """Solve several scenes, each as `solve_scene` does, in lanes as long as states are enough.

    The answer to each does not depend on the others.

    Raises
    ------
    ValueError
        When one of them cannot be followed in time, or not from its start.

    """
    return _side_by_side(scenes, solving_scene)


def settle_scenes(scenes: Sequence[Scene]) -> list[Solved]:
    """Settle several scenes, each as `settle_scene` does; as `solve_scenes` otherwise."""
    return _side_by_side(scenes, settling_scene)


def _side_by_side(
    scenes: Sequence[Scene], asking: Callable[[Scene], Asking[ScenePrediction]]
) -> list[Solved]:
    found: list[Solved] = []
    together: list[Scene] = []
    for scene in scenes:
        if together and sum(map(_held_states, (*together, scene))) > MOST_HELD:
            found += _solved(together, asking)
            together = []
        together.append(scene)
    return found + _solved(together, asking)


def _held_states(scene: Scene) -> float:
    """Say how many states of a scene are held at a time, of all its starts, at most."""
    per_start = REMEMBERED * scene.duration.longest_s / FEWEST_TIMES * scene.drive.frequency_hz
    return per_start * (FEWEST if scene.budget_s > 0.0 else 1.0)


def _solved(scenes: Sequence[Scene], asking: Callable[[Scene], Asking[ScenePrediction]]) -> list[Solved]:
    under_way = [asking(scene) for scene in scenes]
    answers: dict[int, ScenePrediction] = {}
    taken_s = [0.0] * len(scenes)
    while len(answers) < len(scenes):
        asked: dict[int, Sequence[Following]] = {}
        for place, each in enumerate(under_way):
            if place not in answers:
                began_s = time.thread_time()
                try:
                    asked[place] = next(each)
                except StopIteration as end:
                    answers[place] = end.value
                taken_s[place] += time.thread_time() - began_s
        began_s = time.thread_time()
        follow_all([each for several in asked.values() for each in several])
        share_s = (time.thread_time() - began_s) / max(1, sum(len(each) for each in asked.values()))
        for place, several in asked.items():
            taken_s[place] += share_s * len(several)
    return [Solved(answers[place], taken_s[place]) for place in range(len(scenes))]


def solve_in_lanes(scene: Scene) -> ScenePrediction:
    """Solve one scene as `solve_scenes` does among any others: to the last digit the same answer.

    For one scene alone `solve_scene` is faster; of chaos it is another draw.
    """
    return solve_scenes([scene])[0].prediction


def settle_in_lanes(scene: Scene) -> ScenePrediction:
    """Settle one scene as `settle_scenes` does among any others: to the last digit the same answer.

    For one scene alone `settle_scene` is faster; of chaos it is another draw.
    """
    return settle_scenes([scene])[0].prediction
