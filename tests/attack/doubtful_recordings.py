"""Recordings with a known closed form that invite wrong results.

Each member has a random specimen, level, duration and noise. A finding is a reported number that is off by
more than twice its stated bound, or a verdict that contradicts the truth. A withheld number is never a
finding; it is counted.
"""

import random
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from vibench.acquisition.plan import Dwell, SineSweep
from vibench.analysis import Simulation, analyse_files, budgets_of
from vibench.analysis.chaos.verdict import MotionKind
from vibench.sim import Specimen, base_transmissibility, gong2025

from ..analysis import synthetic_recordings as synthetic
from .tally import Finding, Shard, Tally

SURELY = 2.0
"""A finding exceeds twice its 95 % bound, which happens by chance once in 16,000."""
STEADY = 2e-3
"""Allowed variation of a drive, see `vibench.analysis.chaos.verdict`."""
Faults = tuple[str, ...]


@dataclass(frozen=True)
class Member:
    """Result of the analysis of one member."""

    ending: str
    faults: Faults
    about: str


def members(target: str, member: Callable[[np.random.Generator, Path], Member]) -> Callable[[Shard], Tally]:
    """Return the attack for one kind of member."""

    def attack(shard: Shard) -> Tally:
        tally = shard.tally(target)
        for number, chance in shard.chances(tally):
            began_s = time.monotonic()
            with tempfile.TemporaryDirectory() as folder:
                said = member(generator(chance), Path(folder))
            tally.count(said.ending, time.monotonic() - began_s)
            if said.faults:
                tally.findings.append(Finding(target, shard.seed, number, said.faults, said.about))
        return tally

    return attack


def generator(chance: random.Random) -> np.random.Generator:
    """Return numpy's random generator for a member."""
    return np.random.default_rng(chance.getrandbits(64))


def specimen_without_contact(rng: np.random.Generator) -> Specimen:
    """Draw masses and damping; stops are absent or out of reach."""
    contact, gap_m = ("linear", 45e-6) if rng.random() < 0.5 else ("hertz", 1.0)
    nominal = gong2025(damping_time_s=float(10 ** rng.uniform(-6.3, -4.2)), gap_m=gap_m, contact=contact)
    masses = tuple(float(each) for each in np.array(nominal.masses) * rng.uniform(0.6, 1.5, 3))
    return replace(nominal, masses=masses)


def near_a_mode(rng: np.random.Generator, specimen: Specimen) -> float:
    """Draw a frequency [Hz] within some bandwidths of a mode, or anywhere in the range."""
    if rng.random() < 0.25:
        return float(rng.uniform(60, 520))
    mode = int(rng.integers(3))
    middle_hz, damping = specimen.natural_frequencies_hz[mode], specimen.damping_ratios[mode]
    return max(40.0, float(middle_hz * (1 + rng.choice((-1, 1)) * damping * 10 ** rng.uniform(-1, 2))))


def filter_motion(specimen: Specimen, moved_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return base acceleration and m0 velocity of a motion without contact that ends at rest."""
    padded = 1 << int(np.ceil(np.log2(moved_m.size + 40 * synthetic.RATE)))
    frequency_hz = np.fft.rfftfreq(padded, 1 / synthetic.RATE)
    omega = 2 * np.pi * frequency_hz
    spectrum = np.fft.rfft(moved_m, padded)
    through = base_transmissibility(specimen, frequency_hz)[:, 0]
    return tuple(
        np.fft.irfft(spectrum * each, padded)[: moved_m.size] for each in (-(omega**2), 1j * omega * through)
    )


LIGHT_RATE_HZ = 25_600.0
"""Drop-outs are searched only at sample rates above 20 kHz."""
FULL_SCALE_M_PER_S = 1.0


def darken(rng: np.random.Generator, velocity: np.ndarray, first: int, stop: int) -> tuple[str, np.ndarray]:
    """Draw drop-outs between two samples: rate, length, bursts, and the shown signal."""
    per_s = float(10 ** rng.uniform(-0.5, 2))
    count = max(1, round(per_s * (stop - first) / LIGHT_RATE_HZ))
    starts = rng.integers(first, stop - 200, count)
    if rng.random() < 0.4:
        centres = rng.integers(first, stop - 200, max(1, count // 6))
        starts = np.clip(
            rng.choice(centres, count) + rng.normal(0, 300, count).astype(int), first, stop - 200
        )
    kind = str(rng.choice(("level", "zero", "noise", "ramp")))
    mean_s = float(rng.choice((1e-4, 3e-4, 1e-3)))
    dark = velocity.copy()
    for start in starts:
        length = int(np.clip(rng.exponential(mean_s) * LIGHT_RATE_HZ, 1, 100))
        level = rng.uniform(-1, 1) * FULL_SCALE_M_PER_S
        shown = {
            "level": np.full(length, level),
            "zero": np.zeros(length),
            "noise": rng.uniform(-1, 1, length) * FULL_SCALE_M_PER_S,
            "ramp": np.linspace(level, -level, length),
        }
        dark[start : start + length] = shown[kind]
    return f"{count} drop-outs, {kind}, {1e3 * mean_s:g} ms, {len(starts)}", dark


def dark_recording(rng: np.random.Generator, folder: Path) -> Member:
    """A dwell or a sweep, with and without drop-outs."""
    specimen = specimen_without_contact(rng)
    hz, settle_s, length_s = near_a_mode(rng, specimen), 1.0, float(rng.uniform(3, 5))
    usual, synthetic.RATE = synthetic.RATE, LIGHT_RATE_HZ
    try:
        hz = float(np.clip(hz, 60, 560))
        if rng.random() < 0.7:
            motion = synthetic.sine(settle_s + length_s, hz, 1e-6)
            plan: Dwell | SineSweep = Dwell(
                amplitude_vpp=0.02, frequency_hz=hz, settle_s=settle_s, duration_s=length_s
            )
            part = synthetic.Part("dwell", settle_s, settle_s + length_s, {"frequency_hz": hz})
        else:
            ends = {"start_hz": 0.9 * hz, "stop_hz": 1.1 * hz, "duration_s": length_s}
            motion = synthetic.chirp(length_s, 0.9 * hz, 1.1 * hz, 1e-6)
            settle_s = 0.0
            plan = SineSweep(amplitude_vpp=0.02, settle_s=0.0, **ends)
            part = synthetic.Part("sweep", 0.0, length_s, {"start_hz": 0.9 * hz})
        acceleration, velocity = filter_motion(specimen, motion.displacement_m)
        largest = max(np.max(np.abs(velocity)), 0.01 * np.max(np.abs(acceleration)))
        within = float(10 ** rng.uniform(-2.5, 0)) * 0.5 / largest
        base = synthetic.Motion(within * motion.displacement_m, within * acceleration)
        noise_m_per_s = float(10 ** rng.uniform(-6, -4))
        light = within * velocity + noise_m_per_s * rng.standard_normal(velocity.size)
        about, dark = darken(
            rng, light, round(settle_s * LIGHT_RATE_HZ), light.size - round(0.5 * LIGHT_RATE_HZ)
        )
        about += f"; {plan!r}, {within * np.max(np.abs(velocity)):.2g} m/s, noise {noise_m_per_s:.2g}"
        done = []
        for name, shown in (("light", light), ("dark", dark)):
            path = synthetic.write_recording(folder, plan, base, shown, [part], name=name)
            done.append(analyse_files([path], name, Simulation.LEFT_OUT))
    finally:
        synthetic.RATE = usual
    if not done[0].results:
        return Member("refused with light", (), f"{about} {done[0].failures}")
    if not done[1].results:
        return Member("refused", (), about)
    seen, found = (each.results[0] for each in done)
    faults, is_told = [], True
    for one, other in zip(budgets_of(seen), budgets_of(found), strict=True):
        told = not {"noise", "chance"} & {each.value for each in other.not_stated}
        is_told = is_told and told
        off = abs(other.value - one.value)
        # Each base amplitude is at its own frequency; drop-outs can hide the largest response and change it.
        is_same = one.quantity == other.quantity or not one.quantity.startswith("base amplitude")
        if told and is_same and not off <= SURELY * other.expanded + STEADY * abs(one.value):
            faults.append(f"{other.quantity} {other.text}, not {one.value:.5g}")
    if isinstance(plan, Dwell):
        kinds = [each.analysis.motion.verdict.kind for each in (seen, found)]
        if kinds[1] not in {kinds[0], MotionKind.UNDECIDED}:
            faults.append(f"{kinds[1]}, not {kinds[0]}")
    return Member("told" if is_told else "withheld", tuple(faults), about)


attack_dropouts = members("drop-outs", dark_recording)
