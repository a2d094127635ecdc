"""Test how often parameter bounds from statistics of chaos contain the truth, on random specimens.

    python benchmarks/posterior_coverage.py --draws 30 --seed 1
    python benchmarks/posterior_coverage.py --draws 30 --seed 1 --shard 1/3

Each draw has a random specimen (both gaps, m1, c1, contact stiffness), a random wrong description of it, a
random sine or noise, and three to a hundred times the usual sensor noise. The motion is not tracked. The
recording is simulated. A draw without enough impacts is drawn again.
"""

import argparse
import math
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from hidden_motion import load_world

import vibench.cli.environment  # noqa: F401 - one thread, as for the command, before numpy works
from vibench.acquisition import open_recording
from vibench.analysis import AnalysisError
from vibench.analysis.fit.statistical_numbers import statistical_numbers
from vibench.analysis.hidden_motion import Hidden, tracked_specimen, value_of
from vibench.sim import Hertz, Specimen, gong2025, wilson_share

RECORDED_S, BEGIN_S, RATE_HZ = 1.8, 0.5, 25_600.0
FEWEST_IMPACTS = 100


def other(specimen: Specimen, rng: np.random.Generator, shares: tuple[float, ...]) -> Specimen:
    """Return a random specimen: mean gap, gap ratio, m1, c1 and stiffness changed by up to these factors."""
    mean, apart, m1, c1, force = (math.exp(rng.uniform(-1, 1) * math.log(share)) for share in shares)
    masses, dampings = list(specimen.masses), list(specimen.dampings)
    masses[1] *= m1
    dampings[1] *= c1
    lower, upper = specimen.gaps_m
    assert isinstance(specimen.contact, Hertz)
    return replace(
        specimen,
        masses=tuple(masses),
        dampings=tuple(dampings),
        gap_m=mean * apart * upper,
        lower_gap_m=mean / apart * lower,
        contact=Hertz(specimen.contact.stiffness * force),
    )


def check_draw(seed: int, index: int, world: object) -> tuple[str, dict[Hidden, bool | None]]:
    """Return a text, and whether each bound contains the truth; None if a parameter is not determined."""
    rng = np.random.default_rng([seed, index])
    while True:
        true = other(
            gong2025(damping_time_s=float(rng.uniform(1.5e-5, 2.5e-5))), rng, (1.3, 1.2, 1.03, 1.4, 2)
        )
        described = other(true, rng, (1.4, 1.2, 1.03, 1.4, 1.8))
        sine = rng.random() < 0.7
        kind = float(np.round(rng.uniform(230, 290), 1)) if sine else "noise"
        level_vpp = float(rng.uniform(1.2, 3.0) if sine else rng.uniform(7, 12))
        noise = float(10 ** rng.uniform(0.5, 2))
        with tempfile.TemporaryDirectory() as folder:
            shaken = world.shake(
                Path(folder),
                kind,
                level_vpp,
                duration_s=RECORDED_S,
                seed=int(rng.integers(1 << 30)),
                noise=noise,
                rate_hz=RATE_HZ,
                specimen=true,
            )
            if shaken.touches.size < FEWEST_IMPACTS:
                continue
            words = f"{kind}, {level_vpp:.2g} Vpp, noise x{noise:.3g}"
            with open_recording(shaken.path) as recording:
                try:
                    found, distance = statistical_numbers(
                        recording, described, (BEGIN_S, RECORDED_S), kind if sine else None
                    )
                except AnalysisError as error:
                    return f"{words}: refused: {error}", {}
        truth = {each.what: value_of(tracked_specimen(true), each.what) for each in found}
        held = {
            each.what: each.low <= truth[each.what] <= each.high if each.is_determined else None
            for each in found
            if each.what is not Hidden.EXPONENT
        }
        told = "; ".join(
            f"{each.row[0]} {each.row[1]} of {truth[each.what]:.4g}{'' if held[each.what] else ' MISSED'}"
            for each in found
            if each.is_determined
        )
        return f"{words}: distance {distance:.2f}: {told}", held


def coverage_lines(found: list[dict[Hidden, bool | None]]) -> Iterator[str]:
    """Yield for each parameter how often its bounds contain the truth."""
    by_name: dict[str, list[bool | None]] = defaultdict(list)
    for each in found:
        for what, held in each.items():
            by_name[what.value].append(held)
            by_name["all"].append(held)
    for name, answers in by_name.items():
        told = [each for each in answers if each is not None]
        if told:
            share = wilson_share(sum(told), len(told))
            shown = f"{100 * share.share:.1f} % ({100 * share.low:.0f} to {100 * share.high:.0f} %)"
            yield f"{name}: told in {len(told)} of {len(answers)}, held in {sum(told)} = {shown}"
        else:
            yield f"{name}: never told"
    yield f"refused: {sum(not each for each in found)} of {len(found)}"


def main() -> None:
    """Run all draws and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--shard", default="1/1", help="i/n: every nth draw, from the ith")
    asked = parser.parse_args()
    world = load_world()
    shard, shards = (int(part) for part in asked.shard.split("/"))
    found = []
    for index in range(shard - 1, asked.draws, shards):
        words, held = check_draw(asked.seed, index, world)
        print(f"{index}: {words}", flush=True)
        found.append(held)
    print("\n".join(coverage_lines(found)))


if __name__ == "__main__":
    main()
