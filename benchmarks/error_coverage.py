"""Test how often the stated error covers the result of an independent code, on random scenes.

``python benchmarks/error_coverage.py --seed S --scenes 400 [--shard 1/4] [--levels standard] [--lanes]``.
Scenes start from rest; contact law, damping time, gaps, frequency and amplitude are drawn from the ranges
below. Some scenes observe a short transient, all others the end of a longer run. Each is predicted at every
level, and solved by `plain_motion` with two tolerances. The difference of these two results is the error of
`plain_motion`, which is allowed in addition to the stated error.

Three kinds of scene are counted separately. *Settled*: the motion repeats throughout the window. *Transient*:
it does not, but both tolerances agree. *Scattering*: they differ, because small changes grow too much. The
prediction is then one random sample, and is compared with several independent samples, from initial states a
billionth of the gap apart. Each sample counts as a fraction of a scene.

"Covered" is the mean over the four responses, each with its own error; "all by one" tests all four against
``error_estimate``. If a prediction names several motions, the nearest one counts.
"""

import argparse
import json
import math
import sys
import time
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from plain_motion import plain_motion

from vibench.sim import Accuracy, FixedDuration, Harmonic, Scene, gong2025, solve_scene
from vibench.sim.scene.solve import solve_scenes

MODELS = (
    "hertz",
    "hertz",
    "linear_gap",
    "linear_gap",
    "power:3",
    "power:5",
    "power:7",
    "power:29",
    "power:47",
)
UNDAMPED = 0.1
"""Share of scenes without damping."""
UNEVEN = 0.2
"""Share of scenes with two different gaps."""
TRANSIENT = 0.4
"""Share of scenes that end before the motion can settle."""
NAMES = ("response_i", "response_ii", "relative_i", "relative_ii")
TIGHT, LOOSE = 1e-13, 1e-11
"""Two relative tolerances of the independent code; the difference of their results is its own error."""
FORGOTTEN = 1e-3
"""Relative difference of both results above which the motion depends sensitively on its initial state."""
RESOLVED = 5e-11
"""Smallest relative error of the independent code; its peaks of a known motion are 4e-11 too high."""
DRAWS = 5
NUDGE = 1e-9
FAR = 10.0
"""Difference, in stated errors, above which a result counts as wrong."""
WANTED = 0.92


def log_uniform(rng, low, high):
    """Return a random number between two limits, uniform in its logarithm."""
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def random_scene(seed, index):
    """Return random scene ``index``, which is the same in every shard."""
    rng = np.random.default_rng([seed, index])
    model = str(rng.choice(MODELS))
    damping_s = 0.0 if rng.random() < UNDAMPED else float(rng.uniform(0.0, 5e-5))
    gaps = log_uniform(rng, 5e-6, 100e-6), log_uniform(rng, 5e-6, 100e-6)
    frequency_hz, amplitude_m = float(rng.uniform(20.0, 700.0)), log_uniform(rng, 0.2e-6, 200e-6)
    is_uneven = rng.random() < UNEVEN
    if rng.random() < TRANSIENT:
        duration_s = log_uniform(rng, 0.1, 1.0)
        window_s = max(1.0 / frequency_hz, float(rng.uniform(0.2, 0.8)) * duration_s)
    else:
        duration_s, window_s = 5.0, 1.0
    return Scene(
        specimen=gong2025(damping_s, gaps if is_uneven else gaps[0], model),
        drive=Harmonic(frequency_hz, amplitude_m),
        duration=FixedDuration(duration_s, window_s),
    )


@dataclass(frozen=True)
class Truth:
    """Result of the independent code: one result with its own error, or several samples."""

    kind: str
    answers: np.ndarray
    """Four responses of each sample, shape (draws, 4)."""
    own: np.ndarray
    """Relative error of the answers, shape (4,)."""
    period: int | None


def truth_of(scene):
    """Return the result of the independent code for a scene; None if it fails."""
    length = scene.duration.duration_s, scene.duration.window_s
    tight, loose = (
        plain_motion(scene.specimen, scene.drive, *length, tolerance=tol) for tol in (TIGHT, LOOSE)
    )
    if tight is None or loose is None:
        return None
    apart = np.abs(loose.responses / tight.responses - 1.0)
    if apart.max() < FORGOTTEN:
        kind = "transient" if tight.period is None else "settled"
        return Truth(kind, tight.responses[None], apart + RESOLVED, tight.period)
    scale = NUDGE * min(scene.specimen.gaps_m) * np.repeat([1.0, 2.0 * np.pi * scene.drive.frequency_hz], 3)
    rng = np.random.default_rng(1)
    draws = [
        plain_motion(scene.specimen, scene.drive, *length, scale * rng.uniform(-1.0, 1.0, 6), LOOSE)
        for _ in range(DRAWS - 1)
    ]
    answers = [tight.responses, *(draw.responses for draw in draws if draw is not None)]
    return Truth("scattering", np.array(answers), np.zeros(4), None)


def solve_in_a_batch(scene):
    """Solve a scene with the solver for many scenes."""
    return solve_scenes([scene])[0].prediction


def solve_and_measure(scene, truth, level, solve):
    """Predict a scene at a level, and return the comparison as plain values for the table."""
    began = time.process_time()
    asked = Scene(scene.specimen, scene.drive, scene.observe, level, scene.duration, scene.start)
    found = solve(asked)
    taken_s = time.process_time() - began
    errors = [getattr(found, f"{name}_error") for name in NAMES]
    stated = np.array([math.inf if error is None else error for error in errors])
    off = np.abs(truth.answers / answer_of(found) - 1.0)
    # Compare with the nearest of the motions that the prediction names.
    motions = [(answer_of(found), stated)]
    if found.ensemble is not None:
        motions += [
            (answer_of(each), np.full(4, each.error_estimate or 0.0)) for each in found.ensemble.motions
        ]
    times = np.min([times_off(truth, *each) for each in motions], axis=0)
    one = times_off(truth, answer_of(found), np.full(4, stated.max()))
    return {
        "level": level.value,
        "motion": str(found.motion),
        "period": found.period,
        "stated": stated.tolist(),
        "off": off.max(axis=0).tolist(),
        "covered": (times <= 1.0).mean(axis=0).tolist(),
        "all_by_one": float((np.minimum(times, one) <= 1.0).all(axis=1).mean()),
        "times": float(np.median(times.max(axis=1))),
        "is_silent": any(error is None for error in errors),
        "cost_s": taken_s,
    }


def answer_of(found):
    """Return the four responses, shape (4,)."""
    return np.array([getattr(found, name) for name in NAMES], dtype=np.float64)


def times_off(truth, answer, stated):
    """Return the error of ``answer`` against each sample, in units of the stated error, shape (draws, 4)."""
    return np.maximum(np.abs(truth.answers / answer - 1.0) - truth.own, 0.0) / np.maximum(stated, 1e-300)


def parameters_of(scene, index):
    """Return the parameters of a scene, so that it can be repeated."""
    specimen, drive, duration = scene.specimen, scene.drive, scene.duration
    return {
        "scene": index,
        "contact": repr(specimen.contact),
        "damping_time_s": specimen.dampings[0] / specimen.stiffnesses[0],
        "gaps_m": specimen.gaps_m,
        "frequency_hz": drive.frequency_hz,
        "amplitude_m": drive.amplitude_m,
        "duration_s": duration.duration_s,
        "window_s": duration.window_s,
    }


def report(rows):
    """Print the coverage by level and kind of scene, and every scene with a wrong result."""
    groups = defaultdict(list)
    for row in rows:
        groups[row["level"], row["kind"]].append(row)
        groups[row["level"], "all"].append(row)
    heading = f"{'level':10} {'question':11} {'scenes':>6} {'covered':>8} {'all by one':>10}"
    print(heading + "      I    II  p: I p: II  far off  silent  median stated  median off  median cost")
    for (level, kind), members in sorted(groups.items()):
        each = np.mean([row["covered"] for row in members], axis=0)
        print(
            f"{level:10} {kind:11} {len(members):6} {each.mean():8.1%}"
            f" {np.mean([row['all_by_one'] for row in members]):10.1%}  "
            + " ".join(f"{one:5.0%}" for one in each)
            + f" {sum(row['times'] > FAR for row in members):8} {sum(row['is_silent'] for row in members):7}"
            + f" {np.median([max(row['stated']) for row in members]):14.1e}"
            + f" {np.median([max(row['off']) for row in members]):11.1e}"
            + f" {np.median([row['cost_s'] for row in members]):10.3f} s"
        )
    for row in sorted(rows, key=lambda row: -row["times"]):
        if row["times"] > FAR:
            print(
                f"far off by {row['times']:.0f}: {row['level']} {row['kind']} scene {row['scene']}: "
                f"{row['contact']}, damping {row['damping_time_s']:.3g} s, gaps {row['gaps_m']}, "
                f"{row['frequency_hz']:.2f} Hz, {row['amplitude_m']:.4g} m, {row['duration_s']:.3g} s"
            )
    every = [members for (_, kind), members in groups.items() if kind == "all"]
    worst = min(float(np.mean([row["covered"] for row in members])) for members in every)
    print(f"least coverage of a level {worst:.1%}, wanted {WANTED:.0%}")


def main():
    """Draw scenes, predict and compare them, and print the coverage."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=2025)
    parser.add_argument("--scenes", type=int, default=400)
    parser.add_argument("--shard", default="1/1", help="i/n: every nth scene, from the ith")
    parser.add_argument("--levels", default=",".join(Accuracy), help="of accuracy, with commas")
    parser.add_argument("--lanes", action="store_true", help="answer as in a curve of many points")
    parser.add_argument("--only", type=int, help="one scene")
    parser.add_argument(
        "--out", type=Path, help="file of JSON lines; the files of all shards can be told together"
    )
    parser.add_argument("--tell", type=Path, nargs="+", help="say what is in such files, and compute nothing")
    arguments = parser.parse_args()
    if arguments.tell:
        report([json.loads(line) for path in arguments.tell for line in path.read_text().splitlines()])
        return
    solve = solve_in_a_batch if arguments.lanes else solve_scene
    shard, shards = (int(part) for part in arguments.shard.split("/"))
    indices = range(shard - 1, arguments.scenes, shards) if arguments.only is None else [arguments.only]
    rows, given_up = [], 0
    for index in indices:
        scene = random_scene(arguments.seed, index)
        truth = truth_of(scene)
        if truth is None:
            given_up += 1
            print(f"scene {index}: the independent code gave up", file=sys.stderr)
            continue
        for level in arguments.levels.split(","):
            said = parameters_of(scene, index) | solve_and_measure(scene, truth, Accuracy(level), solve)
            rows.append(said | {"kind": truth.kind, "true_period": truth.period, "own": truth.own.tolist()})
            if arguments.out is not None:
                with arguments.out.open("a") as file:
                    file.write(json.dumps(rows[-1]) + "\n")
            if arguments.only is not None:
                print(json.dumps(rows[-1], indent=1))
    report(rows)
    if given_up:
        print(f"{given_up} scenes were given up by the independent code and are not counted")


if __name__ == "__main__":
    main()
