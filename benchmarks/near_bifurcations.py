"""Test whether predictions near a bifurcation are still true minutes later.

    python benchmarks/near_bifurcations.py --count 100 --seed 1 [--shard 1/4] [--save FILE.json]

Each scene is predicted with a fixed duration of 30 s, an automatic duration, and an error of 1 %. The motion
is then continued from the end of each prediction for 300 s. The prediction was wrong

- if it is periodic, and the later motion has another kind or period, or responses beyond both errors;
- if it is quasi-periodic, and the later motion repeats or is chaotic;
- if it is chaotic, and the later motion repeats: chaos that dies out is "chaotic so far" (automatic only).

The responses of a fixed duration are also compared with those of `reference` in the same window.
"""

import argparse
import json
import math
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
from random_scenes import near_bifurcation, scene_line

from vibench.sim import (
    Accuracy,
    AutomaticDuration,
    FixedDuration,
    Given,
    Harmonic,
    MotionKind,
    Outcome,
    Rest,
    Scene,
    ScenePrediction,
    StartMemory,
    Target,
    solve_scene,
)

LATER_S, WINDOW_S = 300.0, 5.0
RESPONSES = ("response_i", "response_ii", "relative_i", "relative_ii")
LEAST = 2e-6
"""Allowed relative difference of a later window: twice the promised error of `standard`."""


def main() -> None:
    """Draw scenes, predict and continue them, and count the wrong predictions."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--shard", default="1/1", help="which part: 3/10 is the third of ten")
    parser.add_argument("--save", type=Path, metavar="FILE.json", help="results, kept and resumed")
    asked = parser.parse_args()
    part, of = (int(each) for each in asked.shard.split("/"))
    found = json.loads(asked.save.read_text("utf-8")) if asked.save and asked.save.exists() else {}
    for number in range(part - 1, asked.count, of):
        if str(number) not in found:
            found[str(number)] = _compare(asked.seed, number)
            if asked.save is not None:
                asked.save.write_text(json.dumps(found), encoding="utf-8")
    counts: Counter[str] = Counter()
    for each in found.values():
        counts.update(f"{answer['asked']}: {answer['motion']}: {answer['judged']}" for answer in each)
    print("\n".join(f"{name}: {count}" for name, count in sorted(counts.items())))
    wrong = sum(answer["judged"] == "WRONG" for each in found.values() for answer in each)
    print(f"wrong: {wrong} of {sum(counts.values())} answers to {len(found)} scenes")


def _compare(seed: int, number: int) -> list[dict[str, str]]:
    random = np.random.default_rng((seed, number))
    event, scene = near_bifurcation(random)
    kinds = {
        "30 s": replace(scene, duration=FixedDuration(30.0, WINDOW_S)),
        "auto": replace(scene, duration=AutomaticDuration()),
        "1 %": replace(scene, duration=FixedDuration(), target=Target(error=0.01, time_s=10.0)),
    }
    found = []
    for name, request in kinds.items():
        answer = solve_scene(request)
        fault = _fault(request, answer)
        judged = "right" if fault is None else "WRONG"
        if answer.motion in {MotionKind.UNDECIDED, MotionKind.CHAOTIC_SO_FAR} and fault is None:
            judged = "open"
        start = "rest" if isinstance(scene.start, Rest) else "near"
        print(
            f"{judged} {number} {event.kind} {scene_line(scene)} from {start}, {name}: {answer.motion} "
            f"{answer.period or ''} I {answer.response_i} +- {answer.error_estimate}; {fault or ''}"
        )
        sys.stdout.flush()
        found.append({"asked": name, "event": event.kind, "motion": answer.motion, "judged": judged})
    return found


def _fault(request: Scene, answer: ScenePrediction) -> str | None:
    """Return a description of what is wrong with a prediction; None if nothing was found."""
    if answer.outcome is not Outcome.REACHED_END:
        return None
    if isinstance(request.duration, FixedDuration) and answer.memory is StartMemory.KEPT:
        strict = solve_scene(replace(request, accuracy=Accuracy.REFERENCE, budget_s=0.0))
        if strict.memory is not StartMemory.LOST and (off := _deviation(answer, strict, 0.0)):
            return f"in the same window {off}"
    later = solve_scene(_later(request, answer))
    if later.outcome is not Outcome.REACHED_END or later.motion is MotionKind.UNDECIDED:
        return None
    is_wrong = {
        MotionKind.PERIODIC: (later.motion, later.period) != (answer.motion, answer.period),
        MotionKind.QUASI_PERIODIC: later.motion is not MotionKind.QUASI_PERIODIC,
        MotionKind.CHAOTIC: later.motion is MotionKind.PERIODIC and request.duration != FixedDuration(),
    }
    if is_wrong.get(answer.motion):
        return f"later {later.motion} {later.period or ''}"
    return _deviation(answer, later, LEAST) if answer.motion is MotionKind.PERIODIC else None


def _later(request: Scene, answer: ScenePrediction) -> Scene:
    """Return the scene that continues from the end of a prediction."""
    drive = request.drive
    turn = 2.0 * math.pi * math.fmod(drive.frequency_hz * answer.duration_s, 1.0)
    return replace(
        request,
        drive=Harmonic(drive.frequency_hz, drive.amplitude_m, turn),
        start=Given(answer.final_state),
        duration=FixedDuration(LATER_S, WINDOW_S),
        budget_s=0.0,
        target=None,
    )


def _deviation(answer: ScenePrediction, truth: ScenePrediction, granted: float) -> str | None:
    """Return a text on the first response that differs by more than both errors and ``granted``; or None."""
    for name in RESPONSES:
        value, true = getattr(answer, name), getattr(truth, name)
        bound = (getattr(answer, f"{name}_error") or 0.0) + (getattr(truth, f"{name}_error") or 0.0)
        if abs(value / true - 1.0) > bound + granted:
            return f"{name} {value:.9g}, not {true:.9g}, bound {bound:.2g}"
    return None


if __name__ == "__main__":
    main()
