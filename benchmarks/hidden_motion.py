"""Test the hidden-state estimate with more noise, lower sample rates and wrong specimen parameters.

Every row is a new rig with its own seeds for noise and excitation; the true motion is known from the
simulation. `python benchmarks/hidden_motion.py [--seeds N] [--first-seed N]` prints the table of
docs/hidden-motion.md.
"""

import argparse
import importlib.util
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from types import ModuleType

import numpy as np

import vibench.cli.environment  # noqa: F401 - one thread, as for the command, before numpy works
from vibench.acquisition import open_recording
from vibench.analysis.hidden_motion import HiddenMotion, Numbers, hidden_motion
from vibench.sim import Specimen

ROOT = Path(__file__).parents[1]
SCORED_FROM_S = 0.4
DURATION_S = 3.4
LOST_M = 5e-6
MICRO = 1e6


def load_world() -> ModuleType:
    """Load the simulation of the tests, which knows the true motion."""
    path = ROOT / "tests" / "analysis" / "hidden_motion" / "shaken_world.py"
    spec = importlib.util.spec_from_file_location("shaken_world", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["shaken_world"] = module
    spec.loader.exec_module(module)
    return module


def _same(specimen: Specimen) -> Specimen:
    return specimen


@dataclass(frozen=True)
class Line:
    """A row of the table."""

    name: str
    kind: object
    level_vpp: float
    noise: float = 1.0
    dropouts_per_s: float = 0.0
    rate_hz: float = 51_200.0
    described: Callable[[Specimen], Specimen] = _same
    numbers: Numbers = Numbers.AS_DESCRIBED


def _with_spring(which: int, factor: float) -> Callable[[Specimen], Specimen]:
    def change(specimen: Specimen) -> Specimen:
        stiffnesses = [k * (factor if n == which else 1.0) for n, k in enumerate(specimen.stiffnesses)]
        return replace(specimen, stiffnesses=tuple(stiffnesses))

    return change


def _with_damping(factor: float) -> Callable[[Specimen], Specimen]:
    return lambda specimen: replace(specimen, dampings=tuple(factor * c for c in specimen.dampings))


def _with_mass(factor: float) -> Callable[[Specimen], Specimen]:
    def change(specimen: Specimen) -> Specimen:
        m0, m1, m2 = specimen.masses
        return replace(specimen, masses=(m0, factor * m1, m2))

    return change


def _gaps(factor: float) -> Callable[[Specimen], Specimen]:
    return lambda specimen: replace(specimen, gap_m=factor * specimen.gap_m)


DWELL, SWEEP, NOISE = (260.0, 1.5), ("sweep", 1.5), ("noise", 10.0)
FOUND = Numbers.FOUND
LINES = (
    *(
        Line(f"{name}, noise x{times:g}", *what, noise=times)
        for times in (1.0, 3.0, 10.0, 30.0)
        for name, what in (("dwell", DWELL), ("sweep", SWEEP), ("noise 10 Vpp", NOISE))
    ),
    *(
        Line(f"{name}, {rate / 1e3:g} kS/s", *what, rate_hz=rate)
        for rate in (25_600.0, 12_800.0)
        for name, what in (("dwell", DWELL), ("noise 10 Vpp", NOISE))
    ),
    *(
        Line(f"{name}, {wrong}, found", *what, described=change, numbers=FOUND)
        for name, what in (("dwell", DWELL), ("noise 10 Vpp", NOISE))
        for wrong, change in (
            ("as described", _same),
            ("m1 +3 %", _with_mass(1.03)),
            ("gaps -3 %", _gaps(0.97)),
            ("k2 +0.1 %", _with_spring(2, 1.001)),
            ("k2 +0.5 %", _with_spring(2, 1.005)),
            ("k0 +0.5 %", _with_spring(0, 1.005)),
            ("damping x1.1", _with_damping(1.1)),
        )
    ),
    *(
        Line(f"{name}, {per_s:g} drop-outs a second, found", *what, dropouts_per_s=per_s, numbers=FOUND)
        for per_s in (2.0, 10.0)
        for name, what in (("dwell", DWELL), ("sweep", SWEEP), ("noise 10 Vpp", NOISE))
    ),
)


def score_row(line: Line, seed: int, world: ModuleType, folder: Path) -> str:
    """Simulate a recording, estimate the hidden motion, and return the comparison as one row."""
    shaken = world.shake(
        folder,
        line.kind,
        line.level_vpp,
        duration_s=DURATION_S,
        seed=seed,
        noise=line.noise,
        dropouts_per_s=line.dropouts_per_s,
        rate_hz=line.rate_hz,
    )
    begun = perf_counter()
    with open_recording(shaken.path) as recording:
        told = hidden_motion(recording, line.described(shaken.specimen), numbers=line.numbers)
    took = (perf_counter() - begun) / DURATION_S
    cells = (*_motion(told, shaken, told.tracked.p), *_impacts(told, shaken))
    free = _motion(told, shaken, told.free.p)
    gaps = [abs(found - true) for found, true in zip(told.gaps_m, shaken.specimen.gaps_m, strict=True)]
    m1 = told.specimen.specimen.masses[1] / shaken.specimen.masses[1] - 1.0
    found = f"{MICRO * max(gaps):.3f}, {100 * m1:+.3f} %" if line.numbers is FOUND else ""
    wide = sum(each.is_determined for each in told.parameters)
    return " | ".join((line.name, *cells, free[0], found, f"{wide}" if found else "", f"{took:.2f}"))


def _motion(told: HiddenMotion, shaken: object, p: np.ndarray) -> tuple[str, str, str]:
    true = shaken.p[told.first_sample : told.first_sample + p.size]
    begin = round(SCORED_FROM_S * told.sample_rate_hz)
    error = (p - true)[begin:]
    followed = ~np.isnan(error)
    if not followed.any():
        return "none", "100 %", ""
    rms = np.sqrt(np.mean(error[followed] ** 2))
    covered = np.mean(np.abs(error[followed]) < 1.96 * told.tracked.p_sd[begin:][followed])
    return f"{MICRO * rms:.3f}", f"{100 * np.mean(~followed):.2f} %", f"{100 * covered:.1f} %"


def _impacts(told: HiddenMotion, shaken: object) -> tuple[str, str]:
    rate = told.sample_rate_hz
    low, high = SCORED_FROM_S * rate, told.first_sample + told.tracked.p.size - 0.03 * rate
    true = shaken.touches[(shaken.touches > low) & (shaken.touches < high)]
    found = np.sort(told.tracked.collisions.samples + told.first_sample)
    near = found[(found > low) & (found < high)]
    reach = 1e-4 * rate
    missed = sum(not np.any(np.abs(found - each) < reach) for each in true)
    false = sum(not np.any(np.abs(shaken.touches - each) < reach) for each in near)
    return f"{100 * (1 - missed / max(true.size, 1)):.2f} %", f"{100 * false / max(near.size, 1):.2f} %"


HEADINGS = (
    "case",
    "p tracked, rms [um]",
    "not followed",
    "within its 95 %",
    "impacts",
    "false",
    "p without a model, rms [um]",
    "gaps within [um], m1",
    "told of 11",
    "s per s",
)


def main() -> None:
    """Run all rows and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=1, help="rigs a line")
    parser.add_argument("--first-seed", type=int, default=1001)
    parser.add_argument("--only", default="", help="lines whose name holds this")
    asked = parser.parse_args()
    world = load_world()
    print(f"| {' | '.join(HEADINGS)} |\n|{'---|' * len(HEADINGS)}")
    seed = asked.first_seed
    for line in (each for each in LINES if asked.only in each.name):
        for _ in range(asked.seeds):
            with tempfile.TemporaryDirectory() as folder:
                print(f"| {score_row(line, seed, world, Path(folder))} |", flush=True)
            seed += 1


if __name__ == "__main__":
    main()
