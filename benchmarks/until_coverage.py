"""Test how often bounds contain the truth if they decide when a recording ends, and the time saved.

    python benchmarks/until_coverage.py --rule                           # the rule alone, on Gaussian records
    python benchmarks/until_coverage.py --count 60 --seed 1 --shard 1/2 --save part1.json
    python benchmarks/until_coverage.py --synthetic --count 1000 --seed 1 --save synthetic.json
    python benchmarks/until_coverage.py --add part1.json part2.json        # the table of what shards kept

The virtual rig makes one recording of each scene at its longest time, in simulated time and with noisier
sensors. The rule of `vibench.acquisition.run.until` is then applied to its beginning, at the times of the
checks and with the analysis that runs during a measurement. Thus each recording ends as if the analysis took
no time. The requested uncertainties are those predicted from the description of the rig for several times.
Linear motion of random rigs is compared with closed forms. The paper's specimen in chaos is compared with the
mean of the other recordings, whose scatter widens the bound. A shard that was ended continues from its file.
"""

import argparse
import json
import re
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from report_coverage import modes, peak
from resonance_coverage import peak as largest, transmission
from scipy.signal import lfilter
from twin_agreement import random_rig

import vibench.cli.environment  # noqa: F401 - one thread, as for the command, before numpy works
from vibench.acquisition import open_bench, open_recording, run_measurement
from vibench.acquisition.plan import (
    FEWEST_REALISATIONS,
    LOOK_FACTOR,
    Dwell,
    Measurement,
    RunState,
    Until,
    WhiteNoise,
)
from vibench.acquisition.rig import Rig, load_rig, specimen_of
from vibench.analysis import AnalysisError, ExpectedResult, budgets_of, expected_uncertainty
from vibench.analysis.frequency_response.resonance import resonances
from vibench.analysis.frequency_response.transmissibility import transmissibility
from vibench.analysis.kinds import AnyResult
from vibench.analysis.recordings.facts import recording_facts
from vibench.analysis.results.growing_bounds import bounds_of, random_bound, result_so_far
from vibench.analysis.sine.dwell import dwell_response
from vibench.analysis.uncertainty.budget import COVERAGE, RESULT_PATTERNS, WIDENING
from vibench.analysis.uncertainty.expected import end_s, needed_s
from vibench.sim import base_transmissibility

VIRTUAL = Path(__file__).parent.parent / "hardware_configs" / "virtual_rig.toml"
KINDS = ("dwell", "noise", "dwell", "dwell", "chaos", "dwell", "noise", "dwell")
WISHES = {"noise": ("resonance_hz", "transmissibility"), "dwell": ("response_ii",), "chaos": ("response_ii",)}
RATE_HZ = 12_800.0
LONGEST_S = 32.0
PIECE_S = 0.5
WEAK_VPP = 0.03
SHARES = (0.1, 0.3, 0.5, 0.7)
"""Positions between first check and longest time, on a logarithmic scale, for which requests are chosen."""
NOISIER = (10.0, 100.0)
"""Range of the factor on the noise of the sensors."""
FARTHEST_HZ = 5.0


@dataclass(frozen=True)
class EndedQuantity:
    """One quantity of one recording that ended when one requested uncertainty was reached."""

    scene: int
    kind: str
    quantity: str
    wish: float
    is_reached: bool
    stopped_s: float
    longest_s: float
    expected_s: float | None
    """Time predicted as by `vibench measure --estimate` [s]; None if it is not known."""
    value: float
    bound: float
    """Relative 95 % bound at the end."""
    whole: float
    """Value of the whole recording."""
    true: float | None


def looks_s(first_s: float, longest_s: float, piece_s: float) -> list[float]:
    """Return the times of the checks, as `UntilWatch` chooses them [s]."""
    due_s, found = first_s, []
    for number in range(1, round(longest_s / piece_s) + 1):
        if number * piece_s >= due_s * (1 - 1e-9):
            found.append(number * piece_s)
            while due_s <= number * piece_s * (1 + 1e-9):
                due_s *= LOOK_FACTOR
    return found


def draw_plan(number: int, seed: int) -> tuple[str, Rig, Measurement]:
    """Return a kind, a random rig with noisier sensors, and a plan."""
    rng = np.random.default_rng((seed, number))
    kind = KINDS[number % len(KINDS)]
    rig, _ = random_rig(rng) if kind != "chaos" else (load_rig(VIRTUAL), "")
    factor = 1.0 if kind == "chaos" else float(np.exp(rng.uniform(*np.log(NOISIER))))
    sensors = ("accelerometer_noise_m_per_s2", "vibrometer_noise_m_per_s_per_rthz")
    more = {name: factor * getattr(rig.virtual, name) for name in sensors}
    virtual = rig.virtual.model_copy(update={**more, "seed": int(rng.integers(1, 1 << 30))})
    daq = rig.daq.model_copy(update={"sample_rate_hz": RATE_HZ})
    rig = rig.model_copy(update={"virtual": virtual, "daq": daq})
    if kind == "noise":
        excitation = WhiteNoise(
            amplitude_vpp=WEAK_VPP, band_start_hz=50, band_stop_hz=600, repetition_hz=2, settle_s=1.0,
            realisations=int(LONGEST_S), seed=int(rng.integers(1, 1 << 30)),
        )  # fmt: skip
    elif kind == "dwell":
        at_hz = float(np.round(rng.uniform(90, 480), 1))
        excitation = Dwell(amplitude_vpp=WEAK_VPP, frequency_hz=at_hz, settle_s=1.5, duration_s=LONGEST_S)
    else:
        excitation = Dwell(amplitude_vpp=1.5, frequency_hz=260, settle_s=1.5, duration_s=LONGEST_S)
    wishes = Until(**dict.fromkeys(WISHES[kind], 1e-6))
    return kind, rig, Measurement(name="measured", excitation=excitation, ramp_s=0.3, until=wishes)


def true_value(rig: Rig, plan: Measurement, quantity: str) -> float | None:
    """Return the closed-form value of linear motion; None if no mode is near."""
    specimen = specimen_of(rig)
    if isinstance(plan.excitation, Dwell):
        played_hz = plan.excitation.frequency_hz * (1 + 1e-6 * rig.virtual.generator_clock_ppm)
        return float(np.abs(base_transmissibility(specimen, [played_hz])[0, 0]))
    stated_hz = float(re.search(r"([\d.]+) Hz", quantity)[1])
    natural_hz = modes(specimen)[0]
    nearest_hz = float(natural_hz[np.argmin(np.abs(natural_hz - stated_hz))])
    if abs(nearest_hz - stated_hz) > FARTHEST_HZ:
        return None
    return nearest_hz if "frequency" in quantity else peak(specimen, nearest_hz)


def record(rig: Rig, plan: Measurement, path: Path) -> None:
    """Record a plan at its longest time."""
    with open_bench(rig) as bench:
        outcome = run_measurement(bench, plan.model_copy(update={"until": None}), path)
    if outcome.state is not RunState.FINISHED:  # stopped by a signal; do not use the recording
        raise SystemExit(outcome.reason)


def scene(number: int, seed: int) -> Iterator[EndedQuantity]:
    """Record once, and end this recording at several requested uncertainties."""
    kind, rig, plan = draw_plan(number, seed)
    is_noise = kind == "noise"
    first_s, piece_s = (FEWEST_REALISATIONS * 1.0, 1.0) if is_noise else (plan.until.shortest_s, PIECE_S)
    expected = expected_uncertainty(plan, rig)
    asked = [(name, wish) for name in WISHES[kind] for wish in predictions(expected, name, first_s)]
    ends: dict[tuple[str, float], tuple[float, AnyResult]] = {}
    last: AnyResult | None = None
    with TemporaryDirectory() as folder:
        path = Path(folder) / "measured.h5"
        record(rig, plan, path)
        with open_recording(path) as recording:
            facts = replace(recording_facts(recording), measurement=plan)
            for time_s in looks_s(first_s, LONGEST_S, piece_s):
                if len(ends) == len(asked):
                    break
                try:
                    last = result_so_far(recording, facts, 1, time_s)
                except AnalysisError:
                    continue
                for name, wish in asked:
                    bound = bounds_of(last).get(name)
                    if bound is not None and bound <= wish:
                        ends.setdefault((name, wish), (time_s, last))
            if kind == "chaos" or len(ends) < len(asked):
                last = result_so_far(recording, facts, 1, LONGEST_S)
    whole = {each.quantity.split(" Hz")[0]: each.value for each in budgets_of(last)} if last else {}
    for name, wish in asked:
        need_s = needed_s(expected, Until(**{name: wish}))
        expected_s = None if need_s is None else end_s(need_s, first_s, LONGEST_S)
        stopped_s, result = ends.get((name, wish), (LONGEST_S, last))
        for budget in () if result is None else budgets_of(result):
            bound, key = random_bound(budget), budget.quantity.split(" Hz")[0]
            if bound and re.search(RESULT_PATTERNS[name], budget.quantity):
                yield EndedQuantity(
                    scene=number,
                    kind=kind,
                    quantity=name,
                    wish=wish,
                    is_reached=(name, wish) in ends,
                    stopped_s=stopped_s,
                    longest_s=LONGEST_S,
                    expected_s=expected_s,
                    value=budget.value,
                    bound=bound,
                    whole=whole.get(key, budget.value),
                    true=None if kind == "chaos" else true_value(rig, plan, budget.quantity),
                )


def predictions(expected: tuple[ExpectedResult, ...], name: str, first_s: float) -> Iterator[float]:
    """Yield the uncertainties that are predicted for several times from the description of the rig."""
    mine = [each for each in expected if re.search(RESULT_PATTERNS[name], each.quantity)]
    scatter = max((each.scatter or 0.0 for each in mine), default=0.0)
    for share in SHARES if scatter else ():
        time_s = first_s * (LONGEST_S / first_s) ** share
        yield min(COVERAGE * WIDENING * scatter * float(np.sqrt(mine[0].time_s / time_s)), 0.9)


def table(found: list[EndedQuantity]) -> Iterator[str]:
    """Yield the table: coverage with and without widening, time saved, quality of predictions."""
    chaos = {each.scene: each.whole for each in found if each.kind == "chaos"}
    rows, times, ratios = defaultdict(list), defaultdict(dict), defaultdict(dict)
    for each in found:
        row = each.kind, each.quantity
        true, more = each.true, 1.0
        if each.kind == "chaos":
            others = np.array([value for scene, value in chaos.items() if scene != each.scene])
            if others.size < 5:
                continue
            true = float(np.mean(others))
            more = float(
                np.hypot(1.0, 2 * np.std(others, ddof=1) / np.sqrt(others.size) / (each.bound * true))
            )
        if true is None:
            continue
        rows[row].append((abs(each.value / true - 1) / (more * each.bound), each.is_reached))
        place = each.scene, each.wish
        times[row][place] = each.stopped_s, each.is_reached
        if each.expected_s is not None and each.is_reached and each.expected_s < each.longest_s:
            ratios[row][place] = each.stopped_s / each.expected_s
    yield "| measured | result | records | bounds | reached | held | unwidened | time saved | within 1.5 |"
    yield "|---|---|---|---|---|---|---|---|---|"
    for row, offs in sorted(rows.items()):
        off = np.array([each for each, _ in offs])
        reached = np.array([flag for _, flag in offs])
        saved = saving(found, row)
        ratio = np.array(list(ratios[row].values()))
        near = np.mean((ratio < 1.5 + 1e-9) & (ratio > 1 / 1.5 - 1e-9)) if ratio.size else np.nan
        records = len({place[0] for place in times[row]})
        held, plain = (100 * np.mean(off[reached] <= most) for most in (1.0, 1 / WIDENING))
        yield (
            f"| {row[0]} | {row[1]} | {records} | {off.size} | {100 * np.mean(reached):.0f} % | "
            f"{held:.1f} % | {plain:.1f} % | {100 * saved:.0f} % | {100 * near:.0f} % of {ratio.size} |"
        )


def saving(found: list[EndedQuantity], row: tuple[str, str]) -> float:
    """Return the share of time saved against a fixed plan that suffices for 95 % of similar requests.

    Requests are similar if they are predicted to take the same time. The time that they really need depends
    on noise and on properties that the description of a rig does not contain.
    """
    alike = defaultdict(dict)
    for each in found:
        if (each.kind, each.quantity) == row and each.expected_s is not None:
            time_s = each.stopped_s if each.is_reached else np.inf
            alike[round(each.expected_s, 3)][each.scene, each.wish] = time_s
    used = fixed = 0.0
    for group in alike.values():
        ends_s = np.array(list(group.values()))
        plan_s = float(np.quantile(ends_s, 0.95, method="higher"))
        if np.isfinite(plan_s):
            used += float(np.sum(np.minimum(ends_s, plan_s)))
            fixed += plan_s * ends_s.size
    return 1 - used / fixed if fixed else float("nan")


SYNTHETIC_HZ = 2048.0
AT_HZ, RESPONSE, DAMPING = 160.0, 2.5, 0.01
SYNTHETIC = {
    "sine in noise": ("response_ii",),
    "sine that wanders": ("response_ii",),
    "streamed noise": ("resonance_hz", "transmissibility"),
}


def synthetic_record(kind: str, rng: np.random.Generator) -> np.ndarray:
    """Return drive, base and response with a known Response or resonance, shape (3, samples)."""
    samples = round((LONGEST_S + 2.0) * SYNTHETIC_HZ)
    omega, time_s = 2 * np.pi * AT_HZ, np.arange(samples) / SYNTHETIC_HZ
    if kind == "streamed noise":
        drive = rng.standard_normal(samples)
        lines_hz = np.fft.rfftfreq(samples, 1 / SYNTHETIC_HZ)
        response = np.fft.irfft(np.fft.rfft(drive) * transmission(lines_hz, [(AT_HZ, DAMPING, 1.0)]), samples)
        return np.stack([drive, drive, response + 0.3 * np.std(response) * rng.standard_normal(samples)])
    wander = np.zeros(samples)
    if kind == "sine that wanders":
        # Let amplitude and phase vary as without a period, with a correlation time of about 0.05 s.
        white = rng.standard_normal((2, samples))
        smooth = lfilter([1.0], [1.0, -np.exp(-20.0 / SYNTHETIC_HZ)], white, axis=1)
        smooth *= 0.15 / np.std(smooth)
        wander = smooth[0] * np.sin(omega * time_s) + smooth[1] * np.cos(omega * time_s)
    base = np.sin(omega * time_s)
    velocity = (-np.cos(omega * time_s) * RESPONSE + RESPONSE * wander) / omega
    size = RESPONSE / omega
    noise = size * (0.5 if kind == "sine in noise" else 0.01) * rng.standard_normal(samples)
    return np.stack([np.sin(omega * time_s), base, velocity + noise])


def synthetic_results(kind: str, record: np.ndarray, time_s: float) -> dict[str, tuple[float, float]]:
    """Return value and relative standard uncertainty of each result from the beginning of a record."""
    if kind != "streamed noise":
        data = record[:, : round((time_s + 2.0) * SYNTHETIC_HZ)]
        found = dwell_response(*data, SYNTHETIC_HZ, near_hz=AT_HZ, window_s=time_s)
        return {"response_ii": (found.response_ii, found.sd_response_ii / found.response_ii)}
    drive, _, response = record[:, : round(time_s * SYNTHETIC_HZ)]
    lines = transmissibility(
        drive, response, SYNTHETIC_HZ, segment_samples=4096, window="hann", overlap=0.5,
        estimator="drive", reference=drive,
    )  # fmt: skip
    for each in resonances(lines, low_hz=0.6 * AT_HZ, high_hz=1.4 * AT_HZ)[:1]:
        return {
            "resonance_hz": (each.frequency_hz, each.sd_frequency_hz / each.frequency_hz),
            "transmissibility": (each.peak_magnitude, each.sd_peak_magnitude / each.peak_magnitude),
        }
    return {}


def synthetic(number: int, seed: int) -> Iterator[EndedQuantity]:
    """End one synthetic record at uncertainties that other records of its kind reach after random times."""
    kind = tuple(SYNTHETIC)[number % len(SYNTHETIC)]
    first_s = 8.0 if kind == "streamed noise" else 2.0
    scatter = rms_uncertainties(kind)
    rng = np.random.default_rng((seed, number))
    record = synthetic_record(kind, rng)
    looks = looks_s(first_s, LONGEST_S, PIECE_S)
    told: dict[float, dict[str, tuple[float, float]]] = {}
    true = {"response_ii": RESPONSE, "resonance_hz": AT_HZ, "transmissibility": shown_peak()}
    for name in SYNTHETIC[kind]:
        promise_s = first_s * (LONGEST_S / first_s) ** float(rng.uniform(0.05, 0.75))
        factor = COVERAGE * WIDENING
        wish = factor * scatter[name] * float(np.sqrt(LONGEST_S / promise_s))
        for time_s in looks:
            if time_s not in told:
                told[time_s] = synthetic_results(kind, record, time_s)
            value, sd = told[time_s].get(name, (np.nan, np.inf))
            if factor * sd <= wish:
                break
        yield EndedQuantity(
            scene=number, kind=kind, quantity=name, wish=wish, is_reached=bool(factor * sd <= wish),
            stopped_s=time_s, longest_s=LONGEST_S, expected_s=end_s(promise_s, first_s, LONGEST_S),
            value=float(value), bound=float(factor * sd), whole=float(value), true=true[name],
        )  # fmt: skip


@cache
def shown_peak() -> float:
    """Return the peak of the synthetic mode."""
    return largest([(AT_HZ, DAMPING, 1.0)], AT_HZ, DAMPING)


@cache
def rms_uncertainties(kind: str) -> dict[str, float]:
    """Return the rms standard uncertainty of eight other whole records, by result."""
    found = defaultdict(list)
    for number in range(8):
        record = synthetic_record(kind, np.random.default_rng((99, number)))
        for name, (_, sd) in synthetic_results(kind, record, LONGEST_S).items():
            found[name].append(sd)
    return {name: float(np.sqrt(np.mean(np.square(sds)))) for name, sds in found.items()}


def rule(runs: int, seed: int) -> Iterator[str]:
    """Yield the worst coverage over all requested uncertainties, for Gaussian records of ten parts."""
    rng = np.random.default_rng(seed)
    lengths = [round(2 * LOOK_FACTOR**look) for look in range(9)]
    sd, mean = np.empty((runs, len(lengths))), np.empty((runs, len(lengths)))
    for first in range(0, runs, 500):
        samples = rng.standard_normal((min(500, runs - first), 10 * lengths[-1]))
        sums = np.concatenate([np.zeros((samples.shape[0], 1)), samples.cumsum(axis=1)], axis=1)
        for look, length in enumerate(lengths):
            parts = np.diff(sums[:, : 10 * length + 1 : length], axis=1) / length
            sd[first : first + 500, look] = parts.std(axis=1, ddof=1) / np.sqrt(10)
            mean[first : first + 500, look] = parts.mean(axis=1)
    for factor in (1.0, 1.2, WIDENING, 1.6):
        worst = 1.0
        for wish in np.geomspace(0.3 / np.sqrt(10 * lengths[-1]), 10 / np.sqrt(10 * lengths[0]), 80):
            bound = COVERAGE * factor * sd
            met = bound <= wish
            ended = np.where(met.any(axis=1), met.argmax(axis=1), len(lengths) - 1)
            rows = np.arange(runs)
            worst = min(worst, float(np.mean(np.abs(mean[rows, ended]) <= bound[rows, ended])))
        yield f"widening {factor:.2f}: {100 * worst:.1f} % held in the worst of 80 wishes"


def main() -> None:
    """Run the requested scenes and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--count", type=int, default=4, help="recordings")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--shard", default="1/1", help="which part of the scenes: 3/10 is the third of ten")
    parser.add_argument("--save", type=Path, metavar="FILE.json", help="keep every end, and go on from it")
    parser.add_argument("--add", type=Path, nargs="+", metavar="FILE.json", help="count what shards kept")
    parser.add_argument("--rule", action="store_true", help="only the rule, on Gaussian records")
    parser.add_argument(
        "--synthetic", action="store_true", help="synthetic records in place of the virtual rig's: fast"
    )
    asked = parser.parse_args()
    if asked.rule:
        print("\n".join(rule(20_000, asked.seed)))
        return
    files = asked.add or ([asked.save] if asked.save is not None and asked.save.exists() else [])
    lines = [json.loads(line) for path in files for line in path.read_text("utf-8").splitlines()]
    found = [EndedQuantity(**each) for line in lines for each in line["ends"]]
    if asked.add is None:
        part, of = (int(each) for each in asked.shard.split("/"))
        done = {line["scene"] for line in lines}
        for number in range(part - 1, asked.count, of):
            if number in done:
                continue
            ends = list((synthetic if asked.synthetic else scene)(number, asked.seed))
            found += ends
            if asked.save is not None:
                with asked.save.open("a", encoding="utf-8") as file:
                    line = {"scene": number, "ends": [asdict(each) for each in ends]}
                    file.write(json.dumps(line) + "\n")
    print("\n".join(table(found)))


if __name__ == "__main__":
    main()
