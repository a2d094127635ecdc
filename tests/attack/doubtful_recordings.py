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
from scipy.signal import oaconvolve

from vibench.acquisition.plan import Dwell, OddMultisine, SineSweep, SteppedLevel, SteppedSine, WhiteNoise
from vibench.analysis import Simulation, analyse_files, budgets_of
from vibench.analysis.chaos.verdict import MotionKind
from vibench.analysis.frequency_response.distortion import distortion
from vibench.sim import Specimen, base_transmissibility, gong2025

from ..analysis import synthetic_recordings as synthetic
from .tally import Finding, Shard, Tally

SURELY = 2.0
"""A finding exceeds twice its 95 % bound, which happens by chance once in 16,000."""
STEADY = 2e-3
"""Allowed variation of a drive, see `vibench.analysis.chaos.period`."""
LEAST_DISTORTION = 5e-4
"""Relative distortion of a transmissibility below which reports have no consequence."""
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


def sensor_noise(rng: np.random.Generator, samples: int, size: float) -> tuple[str, np.ndarray]:
    """Draw sensor noise and its name; `size` is the rms of the sensor's signal."""
    kind = str(rng.choice(("white", "hum", "1/f", "drift", "quantised")))
    level = size * 10 ** rng.uniform(-6, -2.5)
    time_s = np.arange(samples) / synthetic.RATE
    white = rng.standard_normal(samples)
    if kind == "hum":
        mains_hz = rng.choice((50.0, 60.0)) * (1 + rng.uniform(-2e-4, 2e-4)) * rng.integers(1, 4)
        return kind, level * np.sin(2 * np.pi * mains_hz * time_s + rng.uniform(0, 6)) + 1e-2 * level * white
    if kind == "1/f":
        lines = np.fft.rfft(white)
        lines[1:] /= np.sqrt(np.arange(1, lines.size))
        pink = np.fft.irfft(lines, samples)
        return kind, level * pink / pink.std() + 1e-2 * level * white
    if kind == "drift":
        return kind, level * (5 * np.sin(0.3 * time_s + rng.uniform(0, 6)) + 1e-2 * white)
    return kind, level * white


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


def stepped_sine(rng: np.random.Generator, folder: Path) -> Member:
    """Stepped sine of a specimen that has settled, or not."""
    specimen = specimen_without_contact(rng)
    count = int(rng.integers(1, 4))
    settle_s, record_s = float(10 ** rng.uniform(-0.7, 0.6)), float(rng.uniform(0.4, 2.0))
    is_level = rng.random() < 0.3
    levels_m = 10 ** rng.uniform(-7.5, -5.5) * np.ones(count)
    if is_level:
        hz = np.full(count, near_a_mode(rng, specimen))
        levels_m *= np.arange(1, count + 1)
    else:
        hz = np.array([near_a_mode(rng, specimen) for _ in range(count)])
        hz = np.sort(np.clip(hz, 40, 560))[:: int(rng.choice((-1, 1)))]
    whole_s = settle_s + record_s
    time_s = np.arange(round((count * whole_s + 1.0) * synthetic.RATE)) / synthetic.RATE
    step = np.minimum((time_s / whole_s).astype(int), count - 1)
    glide = np.hanning(round(0.5 * min(0.1, settle_s) * synthetic.RATE))
    glide /= glide.sum()
    played_hz = oaconvolve(hz[step], glide)[: step.size]
    is_on = (time_s > 0) & (time_s < time_s[-1] - 0.2)
    level_m = oaconvolve(levels_m[step] * is_on, glide)[: step.size]
    moved_m = level_m * np.sin(2 * np.pi * np.cumsum(played_hz) / synthetic.RATE + rng.uniform(0, 6))
    acceleration, velocity = filter_motion(specimen, moved_m)
    within = min(1.0, 0.5 / np.max(np.abs(velocity)), 50 / np.max(np.abs(acceleration)))
    levels_m, moved_m, acceleration, velocity = (
        within * each for each in (levels_m, moved_m, acceleration, velocity)
    )
    noise_name, noise = sensor_noise(rng, velocity.size, float(np.std(velocity)))
    if noise_name == "quantised":
        step_size = np.std(velocity) * 10 ** rng.uniform(-5, -2)
        noise = np.round((velocity + noise) / step_size) * step_size - velocity
    plan = (
        SteppedLevel(
            frequency_hz=hz[0],
            amplitude_vpp=2e4 * levels_m[-1],
            lowest_vpp=2e4 * levels_m[0],
            step_vpp=2e4 * levels_m[0],
            settle_s=settle_s,
            record_s=record_s,
        )
        if is_level and count > 1
        else SteppedSine(
            amplitude_vpp=2e4 * levels_m[0],
            frequencies_hz=tuple(sorted(hz.tolist())),
            settle_s=settle_s,
            record_s=record_s,
        )
    )
    parts = [
        synthetic.Part(
            "step",
            number * whole_s + settle_s,
            (number + 1) * whole_s,
            {
                "frequency_hz": hz[number],
                "direction": "up",
                "amplitude_vpp": 2e4 * levels_m[number],
            },
        )
        for number in range(count)
    ]
    base = synthetic.Motion(moved_m, acceleration)
    path = synthetic.write_recording(folder, plan, base, velocity + noise, parts, name="step")
    done = analyse_files([path], "steps", Simulation.LEFT_OUT)
    about = f"{plan!r} {specimen.masses} {specimen.damping_ratios} {noise_name}"
    if not done.results:
        return Member("refused", (), f"{about} {done.failures}")
    found = done.results[0].analysis.response
    truth = np.abs(base_transmissibility(specimen, hz)[:, 0])
    size = found.response_i * np.hypot(
        found.slow_change, found.sd_drive_amplitude_m / found.drive_amplitude_m
    )
    faults = []
    for name, value, sd in (
        ("I", found.response_i, np.hypot(size, found.noise_error_i)),
        ("II", found.response_ii, found.sd_response_ii),
    ):
        if value.size != count:
            continue
        off, bound = np.abs(value - truth), 2 * sd
        faults += [
            f"Response {name} at {hz[place]:.5g} Hz {value[place]:.5g} +- {bound[place]:.2g}, "
            f"not {truth[place]:.5g}"
            for place in np.flatnonzero(off > SURELY * bound + STEADY * truth)
        ]
    is_told = np.isfinite(found.sd_response_ii)
    ending = "told" if is_told.all() else "withheld in part" if is_told.any() else "withheld"
    return Member(ending, tuple(faults), about)


attack_steps = members("steps", stepped_sine)


DRIFTS = ("none", "gain", "base gain", "frequency", "damping", "delay", "gain and frequency", "within")
DISTORTIONS = ("none", "cube", "square", "dead zone")


def draw_drift(rng: np.random.Generator, count: int) -> np.ndarray:
    """Draw the drift of a property over realisations, with zero mean and a maximum of 1."""
    course = str(rng.choice(("line", "walk", "random", "step", "turn")))
    place = np.linspace(-1, 1, count)
    shapes = {
        "line": place,
        "walk": np.cumsum(rng.standard_normal(count)),
        "random": rng.standard_normal(count),
        "step": np.sign(place - rng.uniform(-0.5, 0.5)),
        "turn": np.sin(3 * place + rng.uniform(0, 6)),
    }
    shape = shapes[course] - np.mean(shapes[course])
    return shape / np.max(np.abs(shape))


def periodic_noise(rng: np.random.Generator, folder: Path) -> Member:
    """Noise realisations of a specimen that drifts, is nonlinear, both, or neither."""
    specimen = specimen_without_contact(rng)
    drift, bent = str(rng.choice(DRIFTS)), str(rng.choice(DISTORTIONS, p=(0.7, 0.1, 0.1, 0.1)))
    realisations, periods = int(rng.integers(3, 9)), int(rng.integers(2, 5))
    repetition_hz, start_hz = float(rng.choice((2.0, 4.0, 5.0))), float(rng.uniform(50, 200))
    band = {
        "band_start_hz": start_hz,
        "band_stop_hz": start_hz + float(rng.uniform(100, 300)),
        "repetition_hz": repetition_hz,
    }
    counted = {"amplitude_vpp": 0.2, "realisations": realisations, "periods": periods, "settle_s": 0.25}
    plan = (OddMultisine if rng.random() < 0.5 else WhiteNoise)(**band, **counted)
    omega = 2 * np.pi * repetition_hz * np.array(plan.lines)
    size = float(10 ** rng.uniform(-4, -1.7))
    # Frequencies drift by less than a bandwidth, as when a specimen warms up.
    course, rate = size * draw_drift(rng, realisations), synthetic.RATE
    time_s = np.arange(round((0.25 + periods / repetition_hz) * rate)) / rate
    noise_m_per_s = float(10 ** rng.uniform(-4.5, -2.5))
    strength = float(10 ** rng.uniform(-2.5, -1))
    bases, velocities, parts = [], [], []
    for number, change in enumerate(course):
        stretch = 1 + change * ("frequency" in drift)
        more = 1 + 3 * change * (drift == "damping")
        damped = replace(specimen, dampings=tuple(more * each for each in specimen.dampings))
        ratio = base_transmissibility(damped, omega / stretch / (2 * np.pi))[:, 0]
        ratio = ratio * np.exp(-1j * omega * 1e-4 * change * (drift == "delay"))
        ratio = ratio * (1 + change * drift.startswith("gain"))
        angles = np.outer(omega, time_s) + rng.uniform(0, 2 * np.pi, (omega.size, 1))
        moved = np.ones(omega.size)
        velocity = (moved * omega * np.abs(ratio)) @ np.cos(angles + np.angle(ratio)[:, None])
        unit = np.std(velocity)
        velocity = velocity / unit
        if drift == "within":
            velocity *= 1 + size * np.sin(2 * np.pi * 0.1 * (time_s + number * time_s[-1]))
        shapes = {"none": 0 * velocity, "cube": velocity**3, "square": velocity**2}
        shapes["dead zone"] = -np.clip(velocity, -0.5, 0.5)
        velocity = velocity + strength * shapes[bent] + noise_m_per_s * rng.standard_normal(time_s.size)
        gain = 1 + change * (drift == "base gain")
        bases.append((moved @ np.sin(angles) / unit, -gain * (moved * omega**2) @ np.sin(angles) / unit))
        velocities.append(0.01 * velocity)
        begin_s = number * time_s.size / rate + 0.25
        end_s = begin_s + periods / repetition_hz
        parts.append(synthetic.Part("realisation", begin_s, end_s, {"realisation": number}))
    moved_m, acceleration = 0.01 * np.concatenate(bases, axis=1)
    base = synthetic.Motion(moved_m, acceleration)
    path = synthetic.write_recording(folder, plan, base, np.concatenate(velocities), parts, name="noise")
    done = analyse_files([path], "noise", Simulation.LEFT_OUT)
    about = (
        f"{type(plan).__name__} {band} {counted} drift {drift} {np.ptp(course):.2g}, {bent} {strength:.2g}, "
        f"noise {noise_m_per_s:.2g}"
    )
    if not done.results:
        return Member("refused", (), f"{about} {done.failures}")
    analysis = done.results[0].analysis
    found = distortion(analysis.response.periodic)
    about += f"; {found.drift}, noise {found.noise_share:.2g}, distortion {found.distortion_share:.2g}"
    faults = []
    is_bound = found.drift is not None and found.drift.frequency_share > 0
    if bent == "none" and not is_bound and found.distortion_share > LEAST_DISTORTION + 3 * found.noise_share:
        faults.append(f"distortion of {found.distortion_share:.2g}")
    if drift == "none" and found.drift is not None:
        faults.append(f"a drift: {found.drift.text}")
    gain = 0.0 if found.drift is None else found.drift.gain_share
    if drift in {"frequency", "damping", "delay"} and gain > 0.3 * size:
        faults.append(f"a gain drifts: {found.drift.text}")
    is_drift, is_distortion = found.drift is not None, found.distortion_share > found.noise_share
    ending = f"{'drift' if is_drift else 'no drift'}, {'distortion' if is_distortion else 'none'}"
    return Member(ending, tuple(faults), about)


attack_drifts = members("drifts", periodic_noise)


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
        # The amplitude holds at its own frequency, which differs where drop-outs hide the largest response.
        is_same = one.quantity == other.quantity or not one.quantity.startswith("base amplitude")
        if told and is_same and not off <= SURELY * other.expanded + STEADY * abs(one.value):
            faults.append(f"{other.quantity} {other.text}, not {one.value:.5g}")
    if isinstance(plan, Dwell):
        kinds = [each.analysis.motion.verdict.kind for each in (seen, found)]
        if kinds[1] not in {kinds[0], MotionKind.UNDECIDED}:
            faults.append(f"{kinds[1]}, not {kinds[0]}")
    return Member("told" if is_told else "withheld", tuple(faults), about)


attack_dropouts = members("drop-outs", dark_recording)
