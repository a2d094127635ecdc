"""Test whether measurements agree with their twins: ranks over seeds of one rig, z on random rigs.

    python benchmarks/twin_agreement.py --ranks 20           # one chaotic dwell, 20 seeds of the rig's noise
    python benchmarks/twin_agreement.py --rigs 10 --seed 3   # other rigs, levels, frequencies: dwells, noise
    python benchmarks/twin_agreement.py --rigs 10 --json
    python benchmarks/twin_agreement.py --sweeps 6           # sweeps of 20 s: false alarms
    python benchmarks/twin_agreement.py --wrong 1            # the same under four wrong specimens
    python benchmarks/twin_agreement.py --shifts 40          # other rigs, m0 up to 10 samples late
    python benchmarks/twin_agreement.py --stop 200           # verdicts of 16 draws and of fewer

Every measurement is made on the virtual rig with another noise seed, and analysed with 19 draws. If the twin
agrees, all ranks are equally likely, and one set of values in a hundred is outside its limit. With --sweeps,
draws also replace the measurement, each against 16 of the others, in 400 choices.
"""

import argparse
import json
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy.stats import binom, chisquare

from vibench.acquisition import open_bench, open_recording, run_measurement
from vibench.acquisition.plan import Dwell, Measurement, SineSweep, SteppedSine, WhiteNoise
from vibench.acquisition.recording import Recording
from vibench.acquisition.rig import Rig, load_rig
from vibench.analysis import analyse
from vibench.analysis.kinds import ANALYSES
from vibench.analysis.overlay.ensemble import EnsembleCurve, z_limit
from vibench.analysis.recordings.checks import AbstractAnalysis
from vibench.analysis.results.campaign_results import overlay
from vibench.sim import Specimen, gong2025

RIG = load_rig(Path(__file__).parents[1] / "hardware_configs" / "virtual_rig.toml")
DRAWS = 19
DRAWS_OF_SWEEPS = 24
BINS = 5
"""Number of bins of the ranks; 20 seeds give four ranks per bin."""


@dataclass(frozen=True)
class Comparison:
    """Comparison of one quantity of one measurement with its draws."""

    scene: str
    quantity: str
    compared: int
    outside: int
    largest_z: float
    limit_z: float
    rank: int | None
    """Rank of a single value among the draws."""
    draws: int


def compare(
    rig: Rig,
    excitation: Dwell | WhiteNoise | SineSweep | SteppedSine,
    scene: str,
    specimen: Specimen | None = None,
    draws: int = DRAWS,
    curves: dict[str, list[np.ndarray]] | None = None,
    shifts: tuple[float, ...] = (0.0,),
) -> Iterator[Comparison]:
    """Measure, simulate and compare; all draws of a quantity are added to ``curves``.

    The comparison is repeated with the channel of m0 late by each of ``shifts`` [samples].
    """
    with TemporaryDirectory() as folder:
        path = Path(folder) / "measured.h5"
        with open_bench(rig) as bench:
            run_measurement(bench, Measurement(name="measured", excitation=excitation, ramp_s=0.3), path)
        with open_recording(path) as recording:
            found = [analyse_shifted(recording, each) for each in shifts]
            simulation = overlay(recording, analyse(recording), draws=draws, specimen=specimen)
    for curve, (samples, analysis) in product(simulation.ensemble, zip(shifts, found, strict=True)):
        (measured,) = (e for e in ANALYSES[excitation.kind].compared(analysis) if e.name == curve.name)
        each = replace(curve, measured=measured.value)
        if curves is not None and len(each.draws) == draws:
            curves.setdefault(each.name, []).append(each.draws)
        yield Comparison(
            f"{scene}, {simulation.run.impact_rate_hz:.0f} impacts/s, {samples:g} samples late",
            each.name,
            each.compared,
            each.outside,
            each.largest_z,
            each.limit,
            int(each.rank[0]) if each.compared == 1 else None,
            int(each.count[0]),
        )


def analyse_shifted(recording: Recording, samples: float) -> AbstractAnalysis[Any, Any]:
    """Analyse a recording as if the channel of m0 were late by any number of samples."""
    late_s = samples / recording.sample_rate_hz
    channels = tuple(
        replace(each, delay_s=each.delay_s - late_s) if each.role == "m0_velocity" else each
        for each in recording.channels
    )
    return analyse(replace(recording, channels=channels))


def with_seed(rig: Rig, seed: int) -> Rig:
    """Return the same rig with another noise seed."""
    return rig.model_copy(update={"virtual": rig.virtual.model_copy(update={"seed": seed})})


def same_dwell(first_seed: int, seeds: int) -> Iterator[Comparison]:
    """Yield the comparisons of one chaotic dwell, repeated with other noise."""
    plan = Dwell(amplitude_vpp=1.5, frequency_hz=260, settle_s=1.5, duration_s=4.0)
    for seed in range(first_seed, first_seed + seeds):
        yield from compare(with_seed(RIG, seed), plan, f"seed {seed}")


def random_rig(rng: np.random.Generator) -> tuple[Rig, str]:
    """Return a rig with a random specimen and shaker, and its description."""
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
    rig = with_seed(Rig.model_validate(document), int(rng.integers(1, 1 << 30)))
    return rig, f"gap {1e6 * gap_m:.0f} um, damping {1e6 * damping_s:.0f} us"


def noise_plan(level_vpp: float, seed: int) -> WhiteNoise:
    """Return four realisations of noise from 50 to 600 Hz."""
    return WhiteNoise(
        amplitude_vpp=level_vpp,
        band_start_hz=50,
        band_stop_hz=600,
        repetition_hz=2,
        realisations=4,
        periods=2,
        settle_s=1.5,
        seed=seed,
    )


def random_scenes(count: int, seed: int) -> Iterator[Comparison]:
    """Measure a dwell and noise on each of ``count`` random rigs."""
    rng = np.random.default_rng(seed)
    for number in range(count):
        rig, words = random_rig(rng)
        level_vpp = float(10 ** rng.uniform(-0.7, 0.9))
        frequency_hz = float(np.round(rng.uniform(90, 480), 1))
        dwell = Dwell(amplitude_vpp=level_vpp, frequency_hz=frequency_hz, settle_s=1.5, duration_s=4.0)
        noise = noise_plan(level_vpp, int(rng.integers(1, 1 << 30)))
        scene = f"rig {number}: {words}, {level_vpp:.2g} Vpp"
        yield from compare(rig, dwell, f"{scene}, dwell {frequency_hz:g} Hz")
        yield from compare(rig, noise, f"{scene}, noise")


def shifted_channels(count: int, seed: int) -> Iterator[Comparison]:
    """Compare dwells, noise, stepped sines and sweeps of random rigs, correct and with a shifted channel."""
    for number in range(seed, seed + count):
        rng = np.random.default_rng([number, 5])
        rig, words = random_rig(rng)
        rate_hz = (12_800.0, 25_600.0)[number % 2]
        rig = rig.model_copy(update={"daq": rig.daq.model_copy(update={"sample_rate_hz": rate_hz})})
        level_vpp, at_hz = float(10 ** rng.uniform(-1.3, 0.5)), float(np.round(rng.uniform(90, 480), 1))
        plan = (
            Dwell(amplitude_vpp=level_vpp, frequency_hz=at_hz, settle_s=1.5, duration_s=4.0),
            noise_plan(level_vpp, number),
            SteppedSine(
                amplitude_vpp=level_vpp,
                frequencies_hz=tuple(at_hz + step for step in range(0, 40, 5)),
                settle_s=1.0,
                record_s=1.0,
            ),
            SineSweep(amplitude_vpp=level_vpp, start_hz=at_hz, stop_hz=at_hz + 20, duration_s=10),
        )[number // 2 % 4]
        scene = f"rig {number}: {words}, {plan.kind} {level_vpp:.2g} Vpp {at_hz:g} Hz, {rate_hz:g} samples/s"
        yield from compare(rig, plan, scene, draws=16, shifts=(0.0, 0.5, 1.0, 3.0, 10.0))


def sweep_of(rig: Rig, level_vpp: float, start_hz: float) -> tuple[Rig, SineSweep]:
    """Return a rig with half the usual sample rate, and a sweep of 200 intervals."""
    daq = rig.daq.model_copy(update={"sample_rate_hz": 25_600.0})
    return rig.model_copy(update={"daq": daq}), SineSweep(
        amplitude_vpp=level_vpp, start_hz=start_hz, stop_hz=start_hz + 20, duration_s=20, hold="displacement"
    )


def true_sweeps(count: int, seed: int, curves: dict[str, list[np.ndarray]]) -> Iterator[Comparison]:
    """Measure sweeps of the shipped rig and of random rigs in turn."""
    for number in range(seed, seed + count):
        rng = np.random.default_rng(number)
        rig, words = (with_seed(RIG, number), "shipped rig") if number % 2 else random_rig(rng)
        start_hz = float(np.round(rng.uniform(180, 320)))
        rig, plan = sweep_of(rig, 1.5 if number % 2 else float(10 ** rng.uniform(-0.2, 0.6)), start_hz)
        yield from compare(
            rig, plan, f"rig {number}: {words}, sweep from {start_hz:g} Hz", None, DRAWS_OF_SWEEPS, curves
        )


def wrong_sweeps(count: int, seed: int) -> Iterator[Comparison]:
    """Compare sweeps with simulated specimens whose parameters are wrong by a few times a fit's bounds."""
    true = gong2025()
    m0, m1, m2 = true.masses
    wrong = {
        "gap 47 um": gong2025(gap_m=47e-6),
        "gap 46 um": gong2025(gap_m=46e-6),
        "damping 25 us": gong2025(damping_time_s=2.5e-5),
        "m1 + 2 %": replace(true, masses=(m0, 1.02 * m1, m2)),
    }
    for number in range(seed, seed + count):
        rig, plan = sweep_of(with_seed(RIG, number), 1.5, 255.0)
        for words, specimen in wrong.items():
            yield from compare(rig, plan, f"seed {number}, {words}", specimen, 16)


def false_alarms(
    curves: dict[str, list[np.ndarray]], draws: int = 16, choices: int = 400
) -> dict[str, object]:
    """Return the rates of false alarms when draws replace measurements, over random choices."""
    rng, found = np.random.default_rng(0), {}
    for name, sets in curves.items():
        rows = []
        for _ in range(choices):
            values = np.hstack([each[rng.permutation(len(each))[: draws + 1]] for each in sets])
            curve = EnsembleCurve(name, np.arange(values.shape[1]), values[0], values[1:])
            worst = abs(curve.largest_z)
            rows.append((worst > z_limit(curve.compared), worst > curve.limit, worst, curve.limit))
        beyond_normal, beyond, worst, limit = np.transpose(rows)
        found[name] = {
            "values": int(np.hstack(sets).shape[1]),
            "beyond_limit_of_normal_values": float(beyond_normal.mean()),
            "beyond_limit": float(beyond.mean()),
            "largest_z_50_90_99_percent": np.quantile(worst, [0.5, 0.9, 0.99]).round(2).tolist(),
            "median_limit": float(np.median(limit)),
        }
    return found


def compare_early_stop(trials: int, seed: int) -> Iterator[dict[str, object]]:
    """Compare verdicts of 16 draws with those of an early stop at clear agreement, on synthetic values."""
    rng = np.random.default_rng(seed)
    tails = {
        "normal": rng.standard_normal,
        "Student's t of 6": lambda shape: rng.standard_t(6, shape) / np.sqrt(1.5),
    }
    for values, off_by, (name, tail) in product((1, 4, 100), (0.0, 4.0, 6.0), tails.items()):
        alarms = np.zeros((trials, 2), dtype=bool)
        made = np.zeros(trials)
        for trial in range(trials):
            roots = 10.0 + tail((17, values))
            roots[0, : max(1, values // 10)] += off_by
            curves = [
                EnsembleCurve("value", np.arange(values), roots[0] ** 2, roots[1 : 1 + count] ** 2)
                for count in (8, 12, 16)
            ]
            stopped = next((each for each in curves if each.agrees_clearly), curves[-1])
            made[trial] = len(stopped.draws)
            alarms[trial] = not curves[-1].agrees, not stopped.agrees
        yield {
            "values": values,
            "distribution": name,
            "a_tenth_is_off_by_sd": off_by,
            "alarms_of_16_draws": float(alarms[:, 0].mean()),
            "alarms_when_stopped": float(alarms[:, 1].mean()),
            "draws": float(made.mean()),
        }


def summary(found: list[Comparison]) -> dict[str, object]:
    """Return the number of quantities outside their limits, and a test of the ranks."""
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
    """Run the requested comparisons and print them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--ranks", type=int, default=0, metavar="SEEDS")
    parser.add_argument("--first-seed", type=int, default=1000, help="of the ranks")
    parser.add_argument("--rigs", type=int, default=0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--sweeps", type=int, default=0)
    parser.add_argument("--wrong", type=int, default=0, metavar="SEEDS")
    parser.add_argument("--shifts", type=int, default=0, metavar="RIGS")
    parser.add_argument("--stop", type=int, default=0, metavar="TRIALS")
    asked = parser.parse_args()
    found, curves = [], {}
    for scenes in (
        same_dwell(asked.first_seed, asked.ranks),
        random_scenes(asked.rigs, asked.seed),
        true_sweeps(asked.sweeps, asked.seed, curves),
        wrong_sweeps(asked.wrong, asked.seed),
        shifted_channels(asked.shifts, asked.seed),
    ):
        for each in scenes:
            found.append(each)
            place = "" if each.rank is None else f", rank {each.rank} of {each.draws}"
            verdict = "outside" if each.outside else "within" if each.compared else "not compared"
            text = (
                f"{each.scene}: {each.quantity}: {each.compared} values, largest z {each.largest_z:+.1f} "
                f"(limit {each.limit_z:.1f}{place}): {verdict}"
            )
            print(text, file=sys.stderr if asked.json else sys.stdout, flush=True)
    for each in compare_early_stop(asked.stop, asked.seed) if asked.stop else ():
        print(json.dumps(each), file=sys.stderr, flush=True)
    if asked.json:
        print(json.dumps({"summary": summary(found), "compared": [asdict(each) for each in found]}))
    else:
        print(json.dumps(summary(found)))
    if asked.sweeps:
        print(json.dumps(false_alarms(curves)), file=sys.stderr if asked.json else sys.stdout)


if __name__ == "__main__":
    main()
