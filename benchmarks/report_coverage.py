"""Test how often the bounds of a report contain the truth, on short measurements with random rigs.

    python benchmarks/report_coverage.py --rigs 125 --seed 1                # 1000 measurements of each kind
    python benchmarks/report_coverage.py --rigs 125 --seed 1 --shard 1/10   # a tenth of them
    python benchmarks/report_coverage.py --rigs 30 --seed 48 --sensors      # another set of sensors on each

Each rig has a random specimen and shaker, and measures one plan `REPEATS` times with new noise, new random
phases and a new clock error within the stated limit. A quarter of the rigs measures so weakly that the motion
is linear. Then modes, transmissibility and both Responses of a dwell are known in closed form, as for noise
without detected collisions. Any other value is compared with the median of the repeats of the same kind; its
bound is widened by the scatter of this median. Each kind of bound has a row: how many contain the truth, and
how probable so few are if each does in 95 of 100 cases.
"""

import argparse
import json
import re
import sys
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.stats import binom
from twin_agreement import random_rig

import vibench.cli.environment  # noqa: F401 - one thread, as for the command, before numpy works
from vibench.acquisition import LimitExceeded, open_bench, run_measurement
from vibench.acquisition.plan import Dwell, Measurement, RunState, SineSweep, SteppedSine, WhiteNoise
from vibench.acquisition.rig import Rig, specimen_of
from vibench.analysis import AnalysisError, Simulation, analyse_files, budgets_of
from vibench.analysis.frequency_response.noise_response import scatters_beyond_noise
from vibench.sim import Specimen, base_transmissibility

REPEATS = 8
FEWEST_ALIKE = 5
"""Smallest number of repeats for a median."""
CLOCK_PPM = 50.0
WEAK_VPP = 0.03
"""Level without collisions, except for dwells at a resonance, which are checked [Vpp]."""
KINDS = ("noise", "dwell", "sweep", "steps")
LINES = "transmissibility, line by line"
FARTHEST_HZ = 5.0
"""Largest distance between a mode and a resonance that is assigned to it [Hz]."""


@dataclass(frozen=True)
class BoundCheck:
    """One bound of one measurement, compared with the truth."""

    kind: str
    quantity: str
    is_linear: bool
    off: float
    """Error over the expanded uncertainty (k = 2), or share of lines whose bounds miss the truth."""
    scene: str

    @property
    def row(self) -> tuple[str, str]:
        """Row of the table in which the bound is counted."""
        return f"{self.kind}, {'linear' if self.is_linear else 'any motion'}", self.quantity


def random_plan(
    rng: np.random.Generator, kind: str, *, is_weak: bool
) -> WhiteNoise | Dwell | SineSweep | SteppedSine:
    """Return a random short plan of a kind."""
    level_vpp = WEAK_VPP if is_weak else float(10 ** rng.uniform(-1, 0.9))
    at_hz = float(np.round(rng.uniform(90, 480), 1))
    match kind:
        case "noise":
            return WhiteNoise(
                amplitude_vpp=level_vpp, band_start_hz=50, band_stop_hz=600, repetition_hz=2,
                realisations=int(rng.integers(2, 7)), periods=2, settle_s=1.5,
            )  # fmt: skip
        case "dwell":
            return Dwell(
                amplitude_vpp=level_vpp, frequency_hz=at_hz, settle_s=1.5, duration_s=float(rng.uniform(2, 6))
            )
        case "sweep":
            return SineSweep(
                amplitude_vpp=level_vpp, start_hz=at_hz, stop_hz=at_hz + float(rng.choice((-40, 40))),
                duration_s=6.0, settle_s=1.0,
            )  # fmt: skip
        case _:
            steps_hz = tuple(at_hz + float(step) for step in range(0, 40, 10))
            return SteppedSine(amplitude_vpp=level_vpp, frequencies_hz=steps_hz, settle_s=1.0, record_s=0.6)


def with_new_noise(rig: Rig, rng: np.random.Generator) -> Rig:
    """Return the same rig with other noise, and another clock error within the stated limit."""
    other = {
        "seed": int(rng.integers(1, 1 << 30)),
        "converter_clock_ppm": float(rng.uniform(-CLOCK_PPM, CLOCK_PPM)),
    }
    return rig.model_copy(update={"virtual": rig.virtual.model_copy(update=other)})


def with_stated_clock(rig: Rig) -> Rig:
    """Return the rig with the clock error of the converter stated in its configuration."""
    document = rig.model_dump(mode="json")
    document["daq"]["clock_ppm"] = {"value": CLOCK_PPM, "source": "drawn within it"}
    return Rig.model_validate(document)


def random_sensors(rig: Rig, rng: np.random.Generator) -> tuple[Rig, str]:
    """Return the rig with a random sensor on m0, and in half of the cases one on the amplifier's channel."""
    document = rig.model_dump(mode="json")
    channels = {each["role"]: each for each in document["daq"]["channels"]}
    kinds = {
        "acceleration": (f"{rng.uniform(5, 20):.3g} mV/g", 10 ** rng.uniform(-5, -4), 0.0),
        "velocity": (f"{rng.uniform(4, 20):.3g} V/(m/s)", 10 ** rng.uniform(-8, -7), 0.0),
        "displacement": (f"{rng.uniform(5, 20):.3g} mV/um", 10 ** rng.uniform(-11, -10), 1e-5),
        "force": ("22 mV/N", 2e-6, 0.0),
    }
    shown = str(rng.choice(("acceleration", "velocity", "displacement"), p=(0.5, 0.1, 0.4)))
    others = ("base_force", "m1_velocity", "m2_acceleration", "m2_displacement")
    other = str(rng.choice(others)) if rng.uniform() < 0.5 else None
    roles = [] if shown == "velocity" else [f"m0_{shown}"]
    if shown != "velocity":
        document["vibrometer"] = None
        channels["m0_velocity"]["role"] = f"m0_{shown}"
    if other is not None:
        roles.append(other)
        channels["amplifier_voltage"].update(role=other, attenuation=1.0, range_v=5.0)
    for role in roles:
        sensitivity, density, delay_s = kinds[role.partition("_")[2]]
        document["sensors"][role] = {
            "model": "drawn", "sensitivity": sensitivity, "full_scale_v": 5.0, "calibrated": "2026-02-10",
            "delay_s": delay_s, "noise_per_rthz": {"value": density, "source": "drawn"},
        }  # fmt: skip
    return Rig.model_validate(document), f"m0_{shown}, {other or 'amplifier_voltage'}"


def modes(specimen: Specimen) -> tuple[np.ndarray, np.ndarray]:
    """Return natural frequencies [Hz] and damping ratios, from the poles."""
    motion = -np.linalg.solve(
        specimen.mass_matrix, np.hstack((specimen.stiffness_matrix, specimen.damping_matrix))
    )
    poles = np.linalg.eigvals(np.vstack((np.eye(3, 6, 3), motion)))
    poles = poles[poles.imag > 0]
    poles = poles[np.argsort(np.abs(poles))]
    return np.abs(poles) / (2 * np.pi), -poles.real / np.abs(poles)


def peak(specimen: Specimen, near_hz: float) -> float:
    """Return the largest transmissibility to m0 near a mode."""
    return float(np.max(np.abs(base_transmissibility(specimen, near_hz + np.arange(-3, 3, 0.002))[:, 0])))


def true_values(rig: Rig, plan: object) -> dict[str, float]:
    """Return the closed-form values of linear motion, by their names in the table."""
    specimen = specimen_of(rig)
    if isinstance(plan, Dwell):
        played_hz = plan.frequency_hz * (1 + 1e-6 * rig.virtual.generator_clock_ppm)
        ratio = float(np.abs(base_transmissibility(specimen, [played_hz])[0, 0]))
        return {"Response I": ratio, "Response II": ratio}
    if not isinstance(plan, WhiteNoise):
        return {}
    found = {}
    for number, (natural_hz, ratio) in enumerate(zip(*modes(specimen), strict=True), start=1):
        found[f"mode {number}, frequency"] = float(natural_hz)
        found[f"mode {number}, damping ratio"] = 100 * float(ratio)
        found[f"mode {number}, transmissibility"] = peak(specimen, float(natural_hz))
    return found


def reaches_a_stop(rig: Rig, plan: object, found: dict[str, tuple[float, float]]) -> bool:
    """Return whether linear motion of m1 may exceed a gap, as even a weak dwell may at a resonance.

    While the motion settles, it may beat up to twice its amplitude, and then continue to strike the stops.
    """
    if not isinstance(plan, Dwell) or "base amplitude A0" not in found:
        return False
    specimen = specimen_of(rig)
    relative = abs(base_transmissibility(specimen, [plan.frequency_hz])[0, 3])
    return bool(1e-6 * found["base amplitude A0"][0] * 2 * relative > min(specimen.gaps_m))


def stable_name(quantity: str, specimen: Specimen) -> str | None:
    """Return a name that is the same in all repeats: modes by number, largest values without frequency."""
    found = re.search(r"([\d.]+) Hz", quantity)
    if found is None or "largest" in quantity or "A0" in quantity:
        return re.sub(r",? at [\d.]+ Hz", "", quantity)
    distance = np.abs(modes(specimen)[0] - float(found[1]))
    mode = int(np.argmin(distance))
    what = quantity.rsplit(", ", maxsplit=1)[-1] if ", " in quantity else "transmissibility"
    return f"mode {mode + 1}, {what}" if distance[mode] < FARTHEST_HZ else None


def measure_once(rig: Rig, plan: object, path: Path) -> tuple[dict[str, tuple[float, float]], object]:
    """Measure once; return value and expanded uncertainty by quantity, and the analysis."""
    with open_bench(rig) as bench:
        ended = run_measurement(bench, Measurement(name="measured", excitation=plan, ramp_s=0.3), path)
    if ended.state is not RunState.FINISHED:
        print(f"measured again, for the run {ended.state.value}: {ended.reason}", file=sys.stderr, flush=True)
        path.unlink()
        return measure_once(rig, plan, path)
    done = analyse_files([path], "measured", Simulation.LEFT_OUT)
    if not done.results:
        raise AnalysisError(str(done.failures))
    (result,) = done.results
    found = {}
    for each in budgets_of(result):
        name = stable_name(each.quantity, specimen_of(rig))
        told = {one.cause.value: one.relative for one in each.contributions}
        missing = {"noise", "chance"} & {cause for cause, relative in told.items() if relative is None}
        if name is not None and not missing and name not in found:
            found[name] = each.value, each.expanded
    return found, result.analysis


def scenes(
    rigs: int, seed: int, shard: tuple[int, int], kinds: list[str], *, draws_sensors: bool
) -> Iterator[BoundCheck]:
    """Yield the compared bounds of every kind of measurement on every rig of a shard."""
    first, of = shard
    for number in range(first - 1, rigs, of):
        rng = np.random.default_rng((seed, number))
        rig, words = random_rig(rng)
        if draws_sensors:
            rig, sensors = random_sensors(rig, np.random.default_rng((seed, number, len(KINDS))))
            words = f"{words}, {sensors}"
        rig, is_weak = with_stated_clock(rig), number % 4 == 0
        for kind in KINDS:
            plan = random_plan(rng, kind, is_weak=is_weak)
            if kind in kinds:
                yield from within_limits(
                    rig, plan, (seed, number, KINDS.index(kind)), f"rig {number}: {words}", is_weak=is_weak
                )


def within_limits(
    rig: Rig, plan: object, seeds: tuple[int, int, int], words: str, *, is_weak: bool
) -> list[BoundCheck]:
    """Return the compared bounds of a plan; halve its level as long as it exceeds the limits."""
    scene = f"{words}, {plan.amplitude_vpp:.2g} Vpp"
    rng, kind = np.random.default_rng(seeds), KINDS[seeds[-1]]
    try:
        return list(repeats(rig, plan, rng, kind, is_weak=is_weak, scene=scene))
    except LimitExceeded:
        weaker = plan.model_copy(update={"amplitude_vpp": 0.5 * plan.amplitude_vpp})
        return within_limits(rig, weaker, seeds, words, is_weak=is_weak)


def repeats(
    rig: Rig, plan: object, rng: np.random.Generator, kind: str, *, is_weak: bool, scene: str
) -> Iterator[BoundCheck]:
    """Measure a plan repeatedly, and yield every bound compared with the truth."""
    told: dict[tuple[str, bool], list[tuple[float, float]]] = defaultdict(list)
    for _ in range(REPEATS):
        again = plan.model_copy(update={"seed": int(rng.integers(1, 1 << 30))}) if kind == "noise" else plan
        with TemporaryDirectory() as folder:
            found, analysis = measure_once(with_new_noise(rig, rng), again, Path(folder) / "measured.h5")
        is_linear = is_weak and not reaches_a_stop(rig, plan, found)
        is_linear |= kind == "noise" and not scatters_beyond_noise(analysis.response.periodic)
        for name, value in found.items():
            told[name, is_linear].append(value)
        if is_weak and kind == "noise":
            lines = analysis.response.frequency_response
            exact = np.abs(base_transmissibility(specimen_of(rig), lines.frequency_hz)[:, 0])
            misses = (lines.magnitude_lower > exact) | (lines.magnitude_upper < exact)
            yield BoundCheck(kind, LINES, is_weak, float(np.mean(misses)), scene)
    true = true_values(rig, plan)
    for (name, is_linear), values in told.items():
        value, expanded = np.transpose(values)
        count = value.size
        if is_linear and name in true:
            off = (value - true[name]) / expanded
        elif count >= FEWEST_ALIKE:
            # Compare with the median of the others, and add its scatter.
            others = np.array([np.median(np.delete(value, place)) for place in range(count)])
            off = (value - others) / (expanded * np.sqrt(1 + np.pi / 2 / (count - 1)))
        else:
            continue
        for each in off:
            yield BoundCheck(kind, name, is_linear, float(each), scene)


def table(found: list[BoundCheck]) -> Iterator[str]:
    """Yield the lines of the table, one row for each kind of bound."""
    rows = defaultdict(list)
    for each in found:
        rows[each.row].append(abs(each.off))
    yield "| measured | bound | bounds | held | error over bound, median, largest | probable |"
    yield "|---|---|---|---|---|---|"
    for (kind, quantity), off in sorted(rows.items()):
        size = np.array(off)
        held = int(np.sum(size <= 1))
        share, chance = (
            (1 - np.mean(size), "")
            if quantity == LINES
            else (held / size.size, f"{binom.cdf(held, size.size, 0.95):.2g}")
        )
        yield (
            f"| {kind} | {quantity} | {size.size} | {100 * share:.1f} % | "
            f"{np.median(size):.2f}, {np.max(size):.2f} | {chance} |"
        )


def main() -> None:
    """Run the measurements of a shard and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--rigs", type=int, default=4)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--shard", default="1/1", help="which part of the rigs: 3/10 is the third of ten")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--sensors", action="store_true", help="draw the sensors of every rig, too")
    parser.add_argument("--save", type=Path, metavar="FILE.json", help="keep every bound, as it comes")
    parser.add_argument("--add", type=Path, nargs="+", metavar="FILE.json", help="count what shards kept")
    asked = parser.parse_args()
    if asked.add is not None:
        kept = (json.loads(line) for path in asked.add for line in path.read_text("utf-8").splitlines())
        print("\n".join(table([BoundCheck(**each) for each in kept])))
        return
    part, of = (int(each) for each in asked.shard.split("/"))
    found = []
    for each in scenes(asked.rigs, asked.seed, (part, of), asked.kinds, draws_sensors=asked.sensors):
        found.append(each)
        if asked.save is not None:
            with asked.save.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(each)) + "\n")
        if abs(each.off) > 1:
            missed = f"{each.off:+.2f} of its bound"
            print(f"{each.scene}: {each.kind}, {each.quantity}: {missed}", file=sys.stderr, flush=True)
    print("\n".join(table(found)))


if __name__ == "__main__":
    main()
