"""Test the shares of a basin map against independent initial states; measure the cost of maps.

`basin` draws random initial states from the rectangle of a basin map, and compares the motions they reach
with the stated shares. `map` computes a map with the given number of points, and prints processor time, time
to the first picture, points computed, and the estimate made before; with `--one-by-one` without SIMD lanes.
`lanes` follows random motions in SIMD lanes and one by one, and prints the time per impact on one core,
without observation and with peaks and spectral lines, and the error of both; with heyoka too, if installed.
Then it settles points of a map in both ways. It counts the points that reached another motion, and those at
which several initial states agree.
"""

import argparse
import importlib.util
import math
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from vibench.acquisition import load_toml
from vibench.sim import Accuracy, Given, Harmonic, MotionKind, gong2025, settle_scene, wilson_share
from vibench.sim.engine.run import Watch
from vibench.sim.maps import Map, MapResults, Range, compute_map, estimate_map, map_solver, open_map
from vibench.sim.scene.followed_run import FollowedRun, Stretch, follow_together, follow_with_section
from vibench.sim.scene.solve import Question, solve_scenes
from vibench.sim.study import ExistingStudy, executor_of, store_of

STANDARD = Accuracy.STANDARD.tolerance
SAME = 2e-3
"""Largest relative difference of Response I of equal periodic motions."""
FIELDS = ("x_m", "y_m", "z_m", "vx_m_per_s", "vy_m_per_s", "vz_m_per_s")


def random_scene(plan: Map, rng: np.random.Generator):
    """Return the scene of a random initial state in the rectangle of the map."""
    state = []
    for name in FIELDS:
        value = getattr(plan, name)
        edges = value.edges if isinstance(value, Range) else (value, value)
        state.append(float(rng.uniform(edges[0], edges[-1])))
    return plan.scene((0, 0, 0), Given(tuple(state), "drawn"))


def basin(asked: argparse.Namespace) -> int:
    """Compare the shares of a map with independent initial states; return the number of differences."""
    results = open_map(asked.map)
    rng = np.random.default_rng(asked.seed)
    scenes = [random_scene(results.plan, rng) for _ in range(asked.starts)]
    with ThreadPoolExecutor(asked.workers) as pool:
        found = list(pool.map(settle_scene, scenes))
    missed = 0
    for motion in results.motions:
        is_it = [
            each.motion is motion.motion
            and each.period == motion.period
            and (
                motion.motion is not MotionKind.PERIODIC
                or abs(each.response_i / motion.response_i - 1.0) < SAME
            )
            for each in found
        ]
        counted = wilson_share(sum(is_it), len(found))
        apart = counted.low > motion.share.high or counted.high < motion.share.low
        missed += apart
        print(
            f"{motion.motion} {motion.period or ''}: map {motion.share.share:.4f} ({motion.share.low:.4f} to "
            f"{motion.share.high:.4f}), {sum(is_it)} of {len(found)} starts: {counted.share:.4f} "
            f"({counted.low:.4f} to {counted.high:.4f}){' APART' if apart else ''}"
        )
    return missed


def cost(asked: argparse.Namespace) -> int:
    """Compute a map and print its cost."""
    plan = load_toml(Path(__file__).parents[1] / "studies" / "maps" / "map.toml", Map)
    said = plan.model_dump(exclude={"specimen"})
    said["frequency_hz"]["points"], said["amplitude_m"]["points"] = asked.columns, asked.rows
    plan = Map(specimen=plan.specimen, **said)
    # Load modules and tables before the time is measured.
    solver = settle_scene if asked.one_by_one else map_solver(plan)
    solver(plan.scene((0, 0, asked.columns // 2)))
    solver(plan.scene((asked.rows - 1, 0, asked.columns // 2)))
    before = estimate_map(plan, asked.workers)
    print(before.sentence)
    began_s, began_cpu_s = time.perf_counter(), time.process_time()
    steps: list[str] = []

    def print_share(progress) -> None:
        if progress.done >= (progress.of if steps else before.coarse_points):
            steps.append(
                f"{progress.of} points after {time.perf_counter() - began_s:.1f} s, "
                f"{time.process_time() - began_cpu_s:.1f} s of processor time"
            )

    with (
        executor_of(asked.workers, None, solver) as executor,
        store_of(plan, None, ExistingStudy.REFUSE) as store,
    ):
        compute_map(plan, executor, store, print_share, None)
        results = MapResults(plan, store.arrays)
    print("\n".join((steps[0], *steps[-1:])))
    taken_s = float(np.nansum(results.arrays["taken"].astype(float)))
    audit = results.audit
    print(
        f"{results.points} of {plan.grid.size} points computed in {time.perf_counter() - began_s:.1f} s, "
        f"{time.process_time() - began_cpu_s:.1f} s of processor time, {taken_s:.1f} s of them the points' "
        f"own; {audit.wrong} of {audit.audited} filled cells had come to another motion"
    )
    return 0


ROUNDS = 5
"""Number of rounds, in each of which both methods run in turn; the shortest time of each counts."""
WANDERED_S = 1.0
"""Simulated time before a motion is timed [s]."""
COMPARED_S = 0.01
"""Time until the comparison with strict steps [s]; short, as errors in chaos grow by e in a few ms."""
PEERS = 4
PEER_TOLERANCES = 1e-6, 1e-9, 1e-12
PEER_S = 0.3
"""Simulated time for timing two solvers [s]."""
STARTS = 8
PUSH_M = 4.5e-11


def random_runs(count: int, rng: np.random.Generator) -> list[FollowedRun]:
    """Return random runs after 1 s, at a whole drive period, in flight: 60 to 420 Hz, 2 to 50 um."""
    runs = []
    while len(runs) < count:
        drive = Harmonic(rng.uniform(60.0, 420.0), math.exp(rng.uniform(math.log(2e-6), math.log(5e-5))))
        run = FollowedRun(gong2025(), drive, STANDARD, np.zeros(6))
        run.follow(math.ceil(WANDERED_S * drive.frequency_hz) / drive.frequency_hz)
        if run.is_in_flight:
            runs.append(run)
    return runs


def in_lanes(runs: list[FollowedRun], periods: list[int], watch: Watch = Watch.NOTHING) -> list[Stretch]:
    """Follow motions together in SIMD lanes."""
    return follow_together([each.copy() for each in runs], periods, watch)


def one_by_one(
    runs: list[FollowedRun],
    periods: list[int],
    watch: Watch = Watch.NOTHING,
    tolerance: float | None = None,
) -> list[Stretch]:
    """Follow the same motions one after the other."""
    twins = [each.copy(tolerance) for each in runs]
    return [
        follow_with_section(each, (each.periods + count) / each.drive.frequency_hz, watch)
        for each, count in zip(twins, periods, strict=True)
    ]


def ns_per_impact(follow, runs: list[FollowedRun], periods: list[int], watch: Watch) -> float:
    """Follow motions by one method, and return the time per impact [ns]."""
    began_s = time.thread_time()
    found = follow(runs, periods, watch)
    return 1e9 * (time.thread_time() - began_s) / sum(each.impacts for each in found)


def lanes(asked: argparse.Namespace) -> int:
    """Compare SIMD lanes with one motion after the other."""
    rng = np.random.default_rng(asked.seed)
    runs = random_runs(asked.motions, rng)
    periods = [asked.periods] * len(runs)
    print(f"{len(runs)} random motions, {asked.periods} drive periods each, one core:")
    for watch in (Watch.NOTHING, Watch.PEAKS_AND_LINES):
        timed = [
            [ns_per_impact(follow, runs, periods, watch) for follow in (in_lanes, one_by_one)]
            for _ in range(ROUNDS)
        ]
        beside_ns, alone_ns = np.min(timed, axis=0)
        print(
            f"observing {watch.name.lower()}: {beside_ns:.0f} ns per impact in lanes, {alone_ns:.0f} ns one "
            f"by one: {alone_ns / beside_ns:.2f} times"
        )
    short = [math.ceil(COMPARED_S * each.drive.frequency_hz) for each in runs]
    exact = one_by_one(runs, short, tolerance=Accuracy.REFERENCE.tolerance)
    gap_m = runs[0].specimen.gap_m
    for name, found in (("in lanes", in_lanes(runs, short)), ("one by one", one_by_one(runs, short))):
        off = [
            np.abs(one.states[-1, :3] - other.states[-1, :3]).max() / gap_m
            for one, other in zip(found, exact, strict=True)
            if abs(other.states[-1, 1] - other.states[-1, 2]) < gap_m
        ]
        print(f"{name}: {np.median(off):.1e} of a gap from strict steps after {COMPARED_S} s, median")
    if importlib.util.find_spec("heyoka"):
        peer(runs[:PEERS])
    return labels(asked)


def peer(runs: list[FollowedRun]) -> None:
    """Follow some motions in heyoka's batches, eight neighbours of each, and print time and error."""
    from heyoka_peers import LANES, AtHome  # noqa: PLC0415 - only where the peer is there
    from work_precision import constants_of  # noqa: PLC0415

    gap_m, best = runs[0].specimen.gap_m, [AtHome(constants_of(each)) for each in runs]
    periods = [math.ceil(COMPARED_S * each.drive.frequency_hz) for each in runs]
    exact = [
        each.states[-1, :3] for each in one_by_one(runs, periods, tolerance=Accuracy.REFERENCE.tolerance)
    ]

    def off(states) -> float:
        apart = [np.abs(one[:3] - other).max() for one, other in zip(states, exact, strict=True)]
        return float(np.median(apart)) / gap_m

    longer = [math.ceil(PEER_S * each.drive.frequency_hz) for each in runs]
    many = [each for each in runs for _ in range(LANES)]
    began_s = time.thread_time()
    in_lanes(many, [count for count in longer for _ in range(LANES)])
    taken = (time.thread_time() - began_s) / (len(many) * PEER_S)
    found = [each.states[-1] for each in in_lanes(runs, periods)]
    said = "{:.2f} ms a simulated second, {:.1e} of a gap off"
    print(f"{len(runs)} of them, eight at a time: " + said.format(1e3 * taken, off(found)))
    for tolerance in PEER_TOLERANCES:
        states = [
            each.end(tolerance, run.motion, count / run.drive.frequency_hz)
            for each, run, count in zip(best, runs, periods, strict=True)
        ]
        pairs = zip(best, runs, strict=True)
        cost = float(np.mean([each.cost(LANES, tolerance, run.motion, PEER_S) for each, run in pairs]))
        told = said.format(1e3 * cost, off(states))
        print(f"heyoka at {tolerance:g}: {told}: {cost / taken:.1f} times as long")


def labels(asked: argparse.Namespace) -> int:
    """Settle random points of a map by both methods; return 1 if more motions differ than by chance.

    The differences by chance are counted one by one, from starts a millionth of a gap away.
    """
    plan = Map(
        frequency_hz=Range(start=60.0, stop=420.0, points=600),
        amplitude_m=Range(start=2e-6, stop=5e-5, points=400, spacing="logarithmic"),
        random_starts=STARTS - 1,
    )
    rng = np.random.default_rng(asked.seed)
    places = [(int(rng.integers(400)), int(rng.integers(600))) for _ in range(asked.points)]
    first = [plan.scene((row, 0, column)) for row, column in places]
    began_s = time.thread_time()
    alone = [settle_scene(scene) for scene in first]
    alone_s, began_s = time.thread_time() - began_s, time.thread_time()
    beside = [each.prediction for each in solve_scenes(first, Question.MOTION)]
    beside_s = time.thread_time() - began_s
    print(
        f"{asked.points} random points of a map: {1e3 * beside_s / asked.points:.2f} ms each in lanes, "
        f"{1e3 * alone_s / asked.points:.2f} ms one by one: {alone_s / beside_s:.2f} times"
    )
    others = [plan.scene((row, k, column)) for row, column in places for k in range(1, STARTS)]
    reached = [each.prediction for each in solve_scenes(others, Question.MOTION)]
    labels_of = [
        {(each.motion, each.period) for each in (beside[k], *reached[k * (STARTS - 1) :][: STARTS - 1])}
        for k in range(asked.points)
    ]
    agree = [len(each) == 1 for each in labels_of]
    pushed = [replace(scene, start=Given((PUSH_M, 0.0, 0.0, 0.0, 0.0, 0.0), "pushed")) for scene in first]
    again = [settle_scene(scene) for scene in pushed]
    counts = []
    for name, found in (("in lanes", beside), ("one by one, pushed by a millionth of a gap", again)):
        differs = [
            (one.motion, one.period) != (other.motion, other.period)
            for one, other in zip(alone, found, strict=True)
        ]
        counts.append(sum(is_other and is_agreed for is_other, is_agreed in zip(differs, agree, strict=True)))
        print(
            f"{name}: {sum(differs)} of {asked.points} came to another kind or period than one by one; "
            f"{counts[-1]} of the {sum(agree)} where {STARTS} starts in lanes agree"
        )
    return int(counts[0] - counts[1] > 3.0 * math.sqrt(sum(counts) + 1.0))


def main() -> int:
    """Run the requested part."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--workers", type=int, default=2)
    parts = parser.add_subparsers(required=True)
    starts = parts.add_parser("basin")
    starts.add_argument("map", type=Path, help="a map.h5")
    starts.add_argument("--starts", type=int, default=10_000)
    starts.add_argument("--seed", type=int, default=1)
    starts.set_defaults(run=basin)
    points = parts.add_parser("map")
    points.add_argument("--columns", type=int, default=600)
    points.add_argument("--rows", type=int, default=400)
    points.add_argument("--one-by-one", action="store_true", help="without lanes, as the yardstick")
    points.set_defaults(run=cost)
    compared = parts.add_parser("lanes")
    compared.add_argument("--motions", type=int, default=96)
    compared.add_argument("--periods", type=int, default=600)
    compared.add_argument("--points", type=int, default=400)
    compared.add_argument("--seed", type=int, default=1)
    compared.set_defaults(run=lanes)
    asked = parser.parse_args()
    return asked.run(asked)


if __name__ == "__main__":
    sys.exit(main())
