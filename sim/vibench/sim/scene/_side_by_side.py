"""Scenes that are settled beside others, as long as states alone are followed. SI units."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

from ._prediction import ScenePrediction
from ._scene import Scene
from ._solve import settling_scene
from ._states_alone import Following, follow_all


@dataclass(frozen=True, eq=False)
class Settled:
    """What a scene came to that was settled beside others."""

    prediction: ScenePrediction
    taken_s: float
    """Processor time of this thread for it [s]; of what was followed together, its part."""


def settle_scenes(scenes: Sequence[Scene]) -> list[Settled]:
    """Settle several scenes, each as `settle_scene` does, in lanes as long as states are enough.

    The answer to each does not depend on the others.

    Raises
    ------
    ValueError
        When one of them cannot be followed in time, or not from its start.

    """
    under_way = [settling_scene(scene) for scene in scenes]
    answers: dict[int, ScenePrediction] = {}
    taken_s = [0.0] * len(scenes)
    while len(answers) < len(scenes):
        asked: dict[int, Following] = {}
        for place, each in enumerate(under_way):
            if place not in answers:
                began_s = time.thread_time()
                try:
                    asked[place] = next(each)
                except StopIteration as end:
                    answers[place] = end.value
                taken_s[place] += time.thread_time() - began_s
        began_s = time.thread_time()
        follow_all(list(asked.values()))
        for place in asked:
            taken_s[place] += (time.thread_time() - began_s) / len(asked)
    return [Settled(answers[place], taken_s[place]) for place in range(len(scenes))]


def settle_in_lanes(scene: Scene) -> ScenePrediction:
    """Settle one scene as `settle_scenes` does among any others: to the last digit the same answer.

    For one scene alone `settle_scene` is faster; of chaos it is another draw.
    """
    return settle_scenes([scene])[0].prediction
