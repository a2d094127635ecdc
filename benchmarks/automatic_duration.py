"""Test whether `--duration auto` finds the motion in which a run of 300 s ends.

Scenes are drawn at random, and near an edge of chaos. The long run rounds differently, because it is cut at
other instants; if the motion depends sensitively on its initial state, it is another random sample. A
prediction agrees if kind, period and responses agree. With sensitive dependence, it agrees if the long run
ends in one of the motions that it names. "chaotic so far" and "undecided" are counted separately. For
quasi-periodic scenes, the stated errors that cover the long run are counted.
"""

import argparse
import sys
import time
from collections import Counter
from dataclasses import dataclass, replace

import numpy as np
from random_scenes import edge_scene, quasi_periodic_scene, random_scene, scene_line

from vibench.sim import FixedDuration, MotionKind, Outcome, Scene, ScenePrediction, solve_scene

LONG = FixedDuration(300.0, 5.0)
SAME = 2e-3
"""Largest relative difference of the responses of equal motions."""
CHAOS = (MotionKind.CHAOTIC, MotionKind.CHAOTIC_SO_FAR)
RESPONSES = ("response_i", "response_ii", "relative_i", "relative_ii")


@dataclass(frozen=True)
class Comparison:
    """Result of the comparison for one scene."""

    verdict: str
    cost: float
    """Processor time, over that of the prediction without a budget for other initial states."""


def main() -> None:
    """Compare all scenes and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--random", type=int, default=40, help="scenes drawn at random")
    parser.add_argument("--edge", type=int, default=15, help="scenes near an edge of chaos")
    parser.add_argument(
        "--quasi-periodic", type=int, default=25, help="scenes that neither repeat nor are chaotic"
    )
    asked = parser.parse_args()
    random = np.random.default_rng(asked.seed)
    compared = [_compare(random_scene(random)) for _ in range(asked.random)]
    compared += [_compare(edge_scene(random)) for _ in range(asked.edge)]
    covered = [_covered_count(quasi_periodic_scene(random)) for _ in range(asked.quasi_periodic)]
    counts = Counter(each.verdict for each in compared)
    decided = counts["agrees"] + counts["is named"] + counts["DIFFERS"]
    print(f"\nseed {asked.seed}: {dict(counts)} of {len(compared)}; long runs that were lost are not counted")
    print(
        f"agree or named: {(decided - counts['DIFFERS']) / max(decided, 1):.1%} of {decided} that are decided"
    )
    print(f"stated errors of quasi-periodic motions that hold: {sum(covered)} of {4 * len(covered)}")
    print(f"cost over that without a budget, median: {np.median([each.cost for each in compared]):.2f}")


def _compare(scene: Scene) -> Comparison:
    answered, taken_s = _time_solve(scene)
    _, alone_s = _time_solve(replace(scene, budget_s=0.0))
    truth = solve_scene(replace(scene, duration=LONG, budget_s=0.0))
    verdict = _verdict(answered, truth)
    print(
        f"{verdict:10} {scene_line(scene)}: {answered.motion} {answered.period or ''} "
        f"I {answered.response_i:.4g}, "
        f"in the long run {truth.motion} {truth.period or ''} {truth.response_i or 0.0:.4g}; "
        f"start {answered.memory}, {1e3 * taken_s:.0f} ms over {1e3 * alone_s:.0f} ms"
    )
    sys.stdout.flush()
    return Comparison(verdict, taken_s / alone_s)


def _covered_count(scene: Scene) -> int:
    """Return how many responses differ from those of a long run by at most their stated error."""
    found, truth = solve_scene(scene), solve_scene(replace(scene, duration=LONG, budget_s=0.0))
    off = [abs(getattr(found, name) / getattr(truth, name) - 1.0) for name in RESPONSES]
    stated = [getattr(found, f"{name}_error") for name in RESPONSES]
    print(f"{scene_line(scene)}: {found.ended}; off {max(off):.1e}, stated {max(stated):.1e}")
    sys.stdout.flush()
    return sum(one <= error for one, error in zip(off, stated, strict=True))


def _time_solve(scene: Scene) -> tuple[ScenePrediction, float]:
    solve_scene(replace(scene, duration=FixedDuration(0.5, 0.4), budget_s=0.0))
    began = time.process_time()
    found = solve_scene(scene)
    return found, time.process_time() - began


def _verdict(answered: ScenePrediction, truth: ScenePrediction) -> str:
    if truth.outcome is not Outcome.REACHED_END or truth.motion is MotionKind.UNDECIDED:
        return "no truth"
    if answered.motion in {MotionKind.UNDECIDED, MotionKind.CHAOTIC_SO_FAR}:
        return "undecided"
    if _is_same(answered, truth):
        return "agrees"
    named = () if answered.ensemble is None else answered.ensemble.motions
    return "is named" if any(_is_same(each, truth) for each in named) else "DIFFERS"


def _is_same(one: ScenePrediction, truth: ScenePrediction) -> bool:
    if truth.motion in CHAOS or one.motion in CHAOS:
        return one.motion in CHAOS and truth.motion in CHAOS
    off = [abs(getattr(one, name) / getattr(truth, name) - 1.0) for name in RESPONSES]
    return one.motion is truth.motion and one.period == truth.period and max(off) < SAME


if __name__ == "__main__":
    main()
