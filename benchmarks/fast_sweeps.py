"""Test the detection of collisions in fast sweeps of random specimens, with and without stops.

    python benchmarks/fast_sweeps.py --count 100 --seed 1 --save fast.json
    python benchmarks/fast_sweeps.py --count 100 --seed 1 --shard 1/4
    python benchmarks/fast_sweeps.py --count 8 --rig        # recorded on the virtual rig, random fixtures
    python benchmarks/fast_sweeps.py --count 100 --unknown  # as if nobody had described the specimen

Each specimen has different masses, damping and gap; each sweep has a different range, rate, direction and
level, and half of the sweeps are logarithmic. The true impacts are those of the simulation. A result is wrong
if it reports a collision without an impact, or reports none in a sweep with impacts in ten intervals. "not
determined" is never wrong.
"""

import argparse
import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import vibench.cli.environment  # noqa: F401 - one thread, as for the command, before numpy works
from vibench.acquisition import open_bench, run_measurement
from vibench.acquisition.plan import Measurement, SineSweep
from vibench.acquisition.rig import Rig, load_rig
from vibench.analysis import Simulation, analyse_files
from vibench.analysis.sine.sweep import SweepResponse, SweepSums
from vibench.analysis.sine.sweep_analysis import Collisions, collisions
from vibench.sim import Sampled, Specimen, base_transmissibility, gong2025, integrate

RATE_HZ = 12_800.0
LEAD_S, TAIL_S, RAMP_S = 3.0, 0.2, 0.5
NOISE = 2e-7
"""Noise density of the vibrometer [m/s per root hertz]."""
CLEARLY = 10
"""Number of intervals with impacts from which a missed collision is wrong."""


@dataclass(frozen=True)
class FastSweep:
    """One sweep of one specimen."""

    specimen: Specimen
    start_hz: float
    stop_hz: float
    duration_s: float
    amplitude_m: float
    seed: int
    is_logarithmic: bool = False


@dataclass(frozen=True)
class Outcome:
    """Result of the analysis of a sweep, with the true numbers of impacts."""

    seed: int
    rate_hz_per_s: float
    struck: int
    """Number of intervals with impacts."""
    colliding: int
    """Number of intervals reported as colliding."""
    both: int
    not_determined_hz: tuple[tuple[float, float], ...]
    largest_ii: float
    steady_over_swept: float
    steady_ii: float
    """Largest Response II of the specimen without contact within the sweep, in closed form."""

    @property
    def is_wrong(self) -> bool:
        """Whether collisions were reported without impacts, or clear ones were missed."""
        is_missed = self.struck >= CLEARLY and not self.both and not self.not_determined_hz
        return is_missed or (self.struck == 0 and self.colliding > 0)


def fast_sweep(number: int, seed: int = 1) -> FastSweep:
    """Return a random sweep near a resonance of a random specimen."""
    rng = np.random.default_rng((seed, number))
    nominal = gong2025(damping_time_s=float(10 ** rng.uniform(-6.5, -4.4)), gap_m=rng.uniform(20e-6, 80e-6))
    masses = tuple(float(each) for each in np.array(nominal.masses) * rng.uniform(0.7, 1.4, 3))
    specimen = replace(nominal, masses=masses)
    middle_hz = float(rng.choice(specimen.natural_frequencies_hz) * rng.uniform(0.9, 1.1))
    width_hz = min(float(10 ** rng.uniform(1.3, 2.6)), 1.5 * middle_hz)
    duration_s = float(np.clip(width_hz / 10 ** rng.uniform(0, 1.5), 3, 30))
    ends = np.array([max(middle_hz - width_hz / 2, 30.0), middle_hz + width_hz / 2])
    start_hz, stop_hz = (float(each) for each in (ends if rng.random() < 0.5 else ends[::-1]))
    level_m, is_logarithmic = float(10 ** rng.uniform(-7, -4.7)), bool(rng.random() < 0.5)
    return FastSweep(specimen, start_hz, stop_hz, duration_s, level_m, number, is_logarithmic)


def simulate_and_analyse(sweep: FastSweep, contact: str, known: Specimen | None) -> Outcome:
    """Simulate a sweep after a settled sine, and analyse it, with the known specimen if any."""
    lead, tail = round(LEAD_S * RATE_HZ), round(TAIL_S * RATE_HZ)
    time_s = np.arange(lead + round(sweep.duration_s * RATE_HZ) + tail) / RATE_HZ
    swept = np.maximum(time_s - LEAD_S, 0) / sweep.duration_s
    steady_hz = sweep.start_hz + (sweep.stop_hz - sweep.start_hz) * swept
    if sweep.is_logarithmic:
        steady_hz = sweep.start_hz * (sweep.stop_hz / sweep.start_hz) ** swept
    phase = 2 * np.pi * np.cumsum(steady_hz) / RATE_HZ
    rise, fall = (np.clip(each / length, 0, 1) for each, length in ((time_s, RAMP_S), (time_s[::-1], TAIL_S)))
    moved_m = sweep.amplitude_m * (1 - np.cos(np.pi * rise)) * (1 - np.cos(np.pi * fall)) / 4 * np.sin(phase)
    law = gong2025(contact=contact).contact
    specimen = replace(sweep.specimen, contact=law)
    path = integrate(specimen, Sampled(moved_m, RATE_HZ), time_s[-1], sample_rate_hz=RATE_HZ)
    omega = 2 * np.pi * np.fft.rfftfreq(time_s.size, 1 / RATE_HZ)
    base = np.fft.irfft(-(omega**2) * np.fft.rfft(moved_m), time_s.size)
    noise = NOISE * np.sqrt(RATE_HZ / 2) * np.random.default_rng(sweep.seed).standard_normal(time_s.size)
    data = np.stack((np.sin(phase), base, path.states[:, 3] + noise))
    low_hz, high_hz = sorted((sweep.start_hz, sweep.stop_hz))
    sums = SweepSums(RATE_HZ, low_hz=low_hz, high_hz=high_hz)
    before = lead // sums.neighbour_samples * sums.neighbour_samples
    sums.add_neighbour(data[:, lead - before : lead])
    sums.add(data[:, lead : data.shape[1] - tail])
    linear = None if known is None else lambda at_hz: base_transmissibility(known, at_hz)[:, 0]
    found = sums.response(linear=linear)
    return outcome(sweep, found, collisions(found), path.impacts.times_s - LEAD_S)


def outcome(sweep: FastSweep, found: SweepResponse, said: Collisions, impacts_s: np.ndarray) -> Outcome:
    """Return the counts of intervals with impacts and of intervals reported as colliding."""
    edges = np.append(found.time_s, found.time_s[-1] + found.interval_s) - 0.5 * found.interval_s
    struck = np.histogram(impacts_s, edges)[0] > 0
    played_hz = np.linspace(found.frequency_hz.min(), found.frequency_hz.max(), 20_001)
    damping = sweep.specimen.damping_ratios[:, np.newaxis]
    peaks_hz = sweep.specimen.natural_frequencies_hz[:, np.newaxis] * (1 + damping * np.linspace(-2, 2, 2001))
    inside = (peaks_hz >= played_hz[0]) & (peaks_hz <= played_hz[-1])
    played_hz = np.append(played_hz, peaks_hz[inside])
    return Outcome(
        seed=sweep.seed,
        rate_hz_per_s=found.sweep_rate_hz_per_s,
        struck=int(struck.sum()),
        colliding=int(said.is_colliding.sum()),
        both=int((struck & said.is_colliding).sum()),
        not_determined_hz=said.too_fast_hz,
        largest_ii=float(found.response_ii.max()),
        steady_over_swept=found.steady_over_swept,
        steady_ii=float(np.max(np.abs(base_transmissibility(sweep.specimen, played_hz)[:, 0]))),
    )


def record_sweep(sweep: FastSweep, contact: str, path: Path) -> Outcome:
    """Record a sweep on the virtual rig with a random fixture; without stops, no impact is possible."""
    rng = np.random.default_rng((sweep.seed, 99))
    document = load_rig("virtual_rig").model_dump(mode="json")
    document["shaker"]["fixture_mass_kg"] = float(10 ** rng.uniform(-1.7, 0))
    document["specimen"]["contact"] = contact
    document["specimen"]["damping_time_s"] = sweep.specimen.dampings[0] / sweep.specimen.stiffnesses[0]
    plan = SineSweep(
        amplitude_vpp=float(10 ** rng.uniform(-2, 0.5)),
        start_hz=round(sweep.start_hz),
        stop_hz=round(sweep.stop_hz),
        duration_s=round(sweep.duration_s),
        settle_s=1.0,
    )
    with open_bench(Rig.model_validate(document)) as bench:
        run_measurement(bench, Measurement(name="fast", excitation=plan, ramp_s=0.3), path)
    (result,) = analyse_files([path], "fast", Simulation.LEFT_OUT).results
    return outcome(sweep, result.analysis.response, result.analysis.collisions, np.empty(0))


def main() -> None:
    """Analyse sweeps and count the wrong results."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--shard", default="1/1", help="which part: 3/10 is the third of ten")
    parser.add_argument("--save", type=Path, metavar="FILE.json")
    parser.add_argument("--rig", action="store_true", help="record on the virtual rig, without stops")
    parser.add_argument("--unknown", action="store_true", help="analyse without a specimen")
    asked = parser.parse_args()
    part, of = (int(each) for each in asked.shard.split("/"))
    is_begun = asked.save is not None and asked.save.exists()
    found = json.loads(asked.save.read_text("utf-8")) if is_begun else {}
    for number in range(part - 1, asked.count, of):
        for contact in ("linear",) if asked.rig else ("linear", "hertz"):
            name = f"{number} {contact}"
            if name in found:
                continue
            sweep = fast_sweep(number, asked.seed)
            with TemporaryDirectory() as folder:
                said = (
                    record_sweep(sweep, contact, Path(folder) / "fast.h5")
                    if asked.rig
                    else simulate_and_analyse(sweep, contact, None if asked.unknown else sweep.specimen)
                )
            found[name] = asdict(said) | {"is_wrong": said.is_wrong}
            if said.is_wrong:
                print(name, said, flush=True)
            if asked.save is not None:
                asked.save.write_text(json.dumps(found), encoding="utf-8")
    every = list(found.values())
    steady = [
        each["largest_ii"] * each["steady_over_swept"] / each["steady_ii"] - 1
        for each in every
        if not each["struck"] and not asked.rig and np.isfinite(each["steady_over_swept"])
    ]
    print(f"{len(every)} sweeps, {sum(each['struck'] > 0 for each in every)} with impacts")
    print(f"wrong: {sum(each['is_wrong'] for each in every)}")
    print(f"said to collide: {sum(each['colliding'] > 0 for each in every)}")
    print(f"in part not determined: {sum(bool(each['not_determined_hz']) for each in every)}")
    if steady:
        off = 100 * np.quantile(np.abs(steady), (0.5, 0.95, 1))
        shares = ", ".join(f"{each:.2g} %" for each in off)
        print(f"{len(steady)} largest steady Responses II by the stated ratio, off by {shares}")


if __name__ == "__main__":
    main()
