"""Test whether the stated shares of attractors cover those among 400 initial states.

Random scenes (specimen and drive) are drawn until the requested number has several motions. Each of these is
then followed from other initial states, drawn with another seed, until it settles or 300 s have passed.
"""

import argparse
import sys
from collections.abc import Callable

import numpy as np
from accuracy_motions import is_same_motion
from random_scenes import edge_scene, random_scene, scene_line

from vibench.sim import Ensemble, FoundMotion, ScenePrediction, solve_ensemble, solve_scene

SEED = 77_000


def main() -> None:
    """Draw scenes, compare their shares, and count the covered ones."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scenes", type=int, default=20, help="with more than one motion")
    parser.add_argument("--starts", type=int, default=400)
    asked = parser.parse_args()
    random = np.random.default_rng(asked.seed)
    covered = drawn = 0
    while drawn < asked.scenes:
        scene = edge_scene(random) if random.random() < 0.5 else random_scene(random)
        answered = solve_scene(scene)
        if not answered.is_one_of_several:
            continue
        truth = solve_ensemble(scene, asked.starts, SEED + asked.seed)
        drawn += 1
        is_covered = _is_covered(answered, truth)
        covered += is_covered
        print(f"{'covered' if is_covered else 'MISSED '} {scene_line(scene)}")
        _print_row(answered.ensemble, truth)
    print(f"\nseed {asked.seed}: shares of {asked.starts} starts are covered in {covered} of {drawn} scenes")


def _is_covered(answered: ScenePrediction, truth: Ensemble | None) -> bool:
    """Return whether the stated interval of each motion contains its share among many initial states.

    For a motion that was not found, the interval is zero to the unseen share. Lasting chaos and chaos so far
    count as one kind, because the kind depends on the simulated time.
    """
    stated = answered.ensemble
    if stated is None or truth is None:
        return False
    for motion in truth.motions:
        same = sorted(
            (each for each in stated.motions if is_same_motion(each, motion)), key=_apart_from(motion)
        )
        low, high = (same[0].share.low, same[0].share.high) if same else (0.0, stated.unseen_share)
        if not low <= motion.share.share <= high:
            return False
    return all(
        any(is_same_motion(each, motion) for motion in truth.motions) or each.share.low < 1.0 / truth.starts
        for each in stated.motions
    )


def _apart_from(motion: FoundMotion) -> Callable[[FoundMotion], float]:
    """Return a sort key: the distance of a motion's Response I from that of ``motion``."""
    return lambda each: abs((each.response_i or 0.0) - (motion.response_i or 0.0))


def _print_row(stated: Ensemble | None, truth: Ensemble | None) -> None:
    for name, ensemble in (("stated", stated), ("many", truth)):
        for motion in () if ensemble is None else ensemble.motions:
            print(
                f"    {name:6} {motion.motion} {motion.period or ''} I {motion.response_i:.4g}: "
                f"{motion.starts}, {motion.share.share:.0%} [{motion.share.low:.0%}, {motion.share.high:.0%}]"
            )
    sys.stdout.flush()


if __name__ == "__main__":
    main()
