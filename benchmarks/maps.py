"""Does a basin map state shares that hold those of independent starts, and what does a map cost?

`basin` draws starts at random from the rectangle of a basin map and counts what they come to, beside the
shares that the map states. `map` computes a map with so many points along each axis and says what it took:
processor time, time to the first picture, points computed, and what an estimate made before had said.
"""

import argparse
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from vibench.acquisition import load_toml
from vibench.sim import Given, MotionKind, settle_scene, wilson_share
from vibench.sim.maps import Map, Range, estimate_map, open_map, solve_map

SAME = 2e-3
"""Relative difference of Response I of one periodic motion."""
FIELDS = ("x_m", "y_m", "z_m", "vx_m_per_s", "vy_m_per_s", "vz_m_per_s")


def drawn_scene(plan: Map, rng: np.random.Generator):
    """Give the scene of a start drawn from the rectangle that the map covers."""
    state = []
    for name in FIELDS:
        value = getattr(plan, name)
        edges = value.edges if isinstance(value, Range) else (value, value)
        state.append(float(rng.uniform(edges[0], edges[-1])))
    return plan.scene((0, 0, 0), Given(tuple(state), "drawn"))


def basin(asked: argparse.Namespace) -> int:
    """Count independent starts beside a map."""
    results = open_map(asked.map)
    rng = np.random.default_rng(asked.seed)
    scenes = [drawn_scene(results.plan, rng) for _ in range(asked.starts)]
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
    """Compute a map and say what it took."""
    plan = load_toml(Path(__file__).parents[1] / "studies" / "maps" / "map.toml", Map)
    said = plan.model_dump(exclude={"specimen"})
    said["frequency_hz"]["points"], said["amplitude_m"]["points"] = asked.columns, asked.rows
    plan = Map(specimen=plan.specimen, **said)
    # Kernels are compiled and loaded before the clock starts.
    settle_scene(plan.scene((0, 0, asked.columns // 2)))
    settle_scene(plan.scene((asked.rows - 1, 0, asked.columns // 2)))
    before = estimate_map(plan, asked.workers)
    print(before.sentence)
    began_s, began_cpu_s = time.perf_counter(), time.process_time()
    steps: list[str] = []

    def tell(progress) -> None:
        if progress.kept == progress.points:
            steps.append(
                f"{progress.points} points after {time.perf_counter() - began_s:.1f} s, "
                f"{time.process_time() - began_cpu_s:.1f} s of processor time"
            )

    results = solve_map(plan, workers=asked.workers, observer=tell)
    print("\n".join((steps[0], *steps[-1:])))
    taken_s = float(np.nansum(results.arrays["taken"].astype(float)))
    print(
        f"{results.computed} of {plan.grid.size} points computed in {time.perf_counter() - began_s:.1f} s, "
        f"{time.process_time() - began_cpu_s:.1f} s of processor time, {taken_s:.1f} s of them the points' "
        f"own; {results.audit}"
    )
    return 0


def main() -> int:
    """Read what is asked."""
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
    points.set_defaults(run=cost)
    asked = parser.parse_args()
    return asked.run(asked)


if __name__ == "__main__":
    sys.exit(main())
