"""Whether measurements are draws of their twins: ranks over seeds of one rig, z on random rigs and levels.

    python benchmarks/twin_agreement.py --ranks 20           # one chaotic dwell, 20 seeds of the rig's noise
    python benchmarks/twin_agreement.py --rigs 10 --seed 3   # other rigs, levels, frequencies: dwells, noise
    python benchmarks/twin_agreement.py --rigs 10 --json

Every measurement is made on the virtual rig with another seed of its noise, and analysed with 19 draws. Of an
agreeing twin every rank is as likely as any other, and one set of values in a hundred lies outside its limit.
"""

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.stats import binom, chisquare

from vibench.acquisition import open_bench, open_recording, run_measurement
from vibench.acquisition.plan import Dwell, Measurement, WhiteNoise
from vibench.acquisition.rig import Rig, load_rig
from vibench.analysis import analyse
from vibench.analysis.results.campaign_results import overlay

RIG = load_rig(Path(__file__).parents[1] / "hardware_configs" / "virtual_rig.toml")
DRAWS = 19
BINS = 5
"""Of the ranks: 20 seeds fill four to a bin."""


@dataclass(frozen=True)
class Compared:
    """One quantity of one measurement."""

    scene: str
    quantity: str
    compared: int
    outside: int
    largest_z: float
    limit_z: float
    rank: int | None
    """Of single values, among the draws."""
    draws: int


def compared(rig: Rig, excitation: Dwell | WhiteNoise, scene: str) -> Iterator[Compared]:
    """Measure, simulate and compare."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "measured.h5"
        with open_bench(rig) as bench:
            run_measurement(bench, Measurement(name="measured", excitation=excitation, ramp_s=0.3), path)
        with open_recording(path) as recording:
            laid = overlay(recording, analyse(recording), draws=DRAWS)
    for each in laid.ensemble:
        rank = int(each.rank[0]) if each.compared == 1 else None
        yield Compared(
            f"{scene}, {laid.run.impact_rate_hz:.0f} impacts/s",
            each.name,
            each.compared,
            each.outside,
            each.largest_z,
            each.limit,
            rank,
            int(each.count[0]),
        )


def seeded(rig: Rig, seed: int) -> Rig:
    """Give the same rig with other noise."""
    return rig.model_copy(update={"virtual": rig.virtual.model_copy(update={"seed": seed})})


def same_dwell(first_seed: int, seeds: int) -> Iterator[Compared]:
    """Repeat one chaotic dwell."""
    plan = Dwell(amplitude_vpp=1.5, frequency_hz=260, settle_s=1.5, duration_s=4.0)
    for seed in range(first_seed, first_seed + seeds):
        yield from compared(seeded(RIG, seed), plan, f"seed {seed}")


def random_rig(rng: np.random.Generator) -> tuple[Rig, str]:
    """Draw another specimen on another shaker."""
    gap_m, damping_s = float(rng.uniform(25e-6, 80e-6)), float(10 ** rng.uniform(-4.9, -4.4))
    shaker = RIG.shaker.model_copy(
        update={
            "fixture_mass_kg": float(rng.uniform(0.02, 0.15)),
            "coil_resistance_ohm": float(rng.uniform(2.0, 4.0)),
            "suspension_stiffness_n_per_m": float(rng.uniform(6e3, 2e4)),
        }
    )
    document = RIG.model_dump(mode="json")
    document["specimen"] = {
        "model": "gong2025",
        "damping_time_s": damping_s,
        "gap_m": gap_m,
        "amplitude_limit_m": document["specimen"]["amplitude_limit_m"],
    }
    document["shaker"] = shaker.model_dump(mode="json")
    rig = seeded(Rig.model_validate(document), int(rng.integers(1, 1 << 30)))
    return rig, f"gap {1e6 * gap_m:.0f} um, damping {1e6 * damping_s:.0f} us"


def random_scenes(count: int, seed: int) -> Iterator[Compared]:
    """Measure a dwell and noise on each of so many random rigs."""
    rng = np.random.default_rng(seed)
    for number in range(count):
        rig, words = random_rig(rng)
        level_vpp = float(10 ** rng.uniform(-0.7, 0.9))
        frequency_hz = float(np.round(rng.uniform(90, 480), 1))
        dwell = Dwell(amplitude_vpp=level_vpp, frequency_hz=frequency_hz, settle_s=1.5, duration_s=4.0)
        noise = WhiteNoise(
            amplitude_vpp=level_vpp,
            band_start_hz=50,
            band_stop_hz=600,
            repetition_hz=2,
            realisations=4,
            periods=2,
            settle_s=1.5,
            seed=int(rng.integers(1, 1 << 30)),
        )
        scene = f"rig {number}: {words}, {level_vpp:.2g} Vpp"
        yield from compared(rig, dwell, f"{scene}, dwell {frequency_hz:g} Hz")
        yield from compared(rig, noise, f"{scene}, noise")


def summary(found: list[Compared]) -> dict[str, object]:
    """Count what lies outside, and test the ranks."""
    with_values = [each for each in found if each.compared]
    outside = sum(each.outside > 0 for each in with_values)
    places = [(each.rank + 0.5) / (each.draws + 1) for each in with_values if each.rank is not None]
    binned = np.histogram(places, BINS, (0.0, 1.0))[0]
    return {
        "quantities": len(with_values),
        "outside": outside,
        "chance_of_as_many_outside": float(binom.sf(outside - 1, len(with_values), 0.01)),
        "ranks_in_fifths": binned.tolist(),
        "p_of_even_ranks": float(chisquare(binned).pvalue) if places else None,
    }


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--ranks", type=int, default=0, metavar="SEEDS")
    parser.add_argument("--first-seed", type=int, default=1000, help="of the ranks")
    parser.add_argument("--rigs", type=int, default=0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    found = []
    for scenes in (same_dwell(asked.first_seed, asked.ranks), random_scenes(asked.rigs, asked.seed)):
        for each in scenes:
            found.append(each)
            place = "" if each.rank is None else f", rank {each.rank} of {each.draws}"
            verdict = "outside" if each.outside else "within" if each.compared else "not compared"
            text = (
                f"{each.scene}: {each.quantity}: {each.compared} values, largest z {each.largest_z:+.1f} "
                f"(limit {each.limit_z:.1f}{place}): {verdict}"
            )
            print(text, file=sys.stderr if asked.json else sys.stdout, flush=True)
    if asked.json:
        print(json.dumps({"summary": summary(found), "compared": [asdict(each) for each in found]}))
    else:
        print(json.dumps(summary(found)))


if __name__ == "__main__":
    main()
