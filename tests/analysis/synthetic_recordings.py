"""Recording files of an ideal bench: prescribed base motion and simulated specimen."""

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from vibench.acquisition import Block, Identity
from vibench.acquisition.plan import Measurement, SineSweep, WhiteNoise
from vibench.acquisition.recording import (
    ChannelHeader,
    Origin,
    RecordingHeader,
    RecordingState,
    create_recording,
)
from vibench.acquisition.recording._header import Provenance
from vibench.sim import Sampled, gong2025, integrate

RATE = 6400.0
RAMP_S = 0.5
VOLTS_PER_METRE = 1e4
"""What a drive of 1 V does to the base: 0.1 mm."""
BENCH = {
    "name": "synthetic bench",
    "calibration_valid_days": 730,
    "amplifier": {"model": "amplifier", "serial": "A1", "gain_db": 10.0},
    "specimen": {"model": "gong2025", "contact": "hertz", "damping_time_s": 2e-5, "gap_m": 45e-6},
}
PROVENANCE = Provenance(
    "2026-03-01T12:00:00.000000+00:00", "lab", "Linux", 1, "3.11", {"vibench": "0.1.0"}, "0123abc"
)


@dataclass(frozen=True)
class Motion:
    """Base displacement and acceleration: a sum of ramped signals in closed form."""

    displacement_m: np.ndarray
    acceleration: np.ndarray


@dataclass(frozen=True)
class Part:
    """A labelled part of a recording; times in seconds."""

    label: str
    start_s: float
    stop_s: float
    numbers: dict


def fade(time_s, phase, rate, curvature, amplitude_m):
    """Return amplitude * sin(phase) with half-cosine ramps; phase' = rate, phase'' = curvature."""
    left_s = time_s[-1] - time_s
    rising = time_s < left_s
    x = np.clip(np.where(rising, time_s, left_s) / RAMP_S, 0, 1)
    w = 0.5 * (1 - np.cos(np.pi * x))
    inside = (x > 0) & (x < 1)
    dw = np.where(rising, 1, -1) * np.where(inside, 0.5 * np.pi / RAMP_S * np.sin(np.pi * x), 0)
    ddw = np.where(inside, 0.5 * (np.pi / RAMP_S) ** 2 * np.cos(np.pi * x), 0)
    s, c = np.sin(phase), np.cos(phase)
    return Motion(
        amplitude_m * w * s,
        amplitude_m * (ddw * s + 2 * dw * rate * c + w * (curvature * c - rate**2 * s)),
    )


def times(duration_s):
    """Sample times [s] of a motion of this duration and its ramp-down."""
    return np.arange(round((duration_s + RAMP_S) * RATE)) / RATE


def sine(duration_s, frequency_hz, amplitude_m):
    time_s = times(duration_s)
    omega = 2 * np.pi * frequency_hz
    return fade(time_s, omega * time_s, omega, 0.0, amplitude_m)


def chirp(duration_s, start_hz, stop_hz, amplitude_m):
    time_s = times(duration_s)
    growth = (stop_hz - start_hz) / duration_s
    phase = 2 * np.pi * (start_hz * time_s + 0.5 * growth * time_s**2)
    return fade(time_s, phase, 2 * np.pi * (start_hz + growth * time_s), 2 * np.pi * growth, amplitude_m)


def multisine(duration_s, lines_hz, amplitude_m, seed):
    time_s = times(duration_s)
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(lines_hz))
    parts = [
        fade(time_s, 2 * np.pi * f * time_s + p, 2 * np.pi * f, 0.0, amplitude_m)
        for f, p in zip(lines_hz, phases, strict=True)
    ]
    return Motion(sum(each.displacement_m for each in parts), sum(each.acceleration for each in parts))


def joined(motions):
    """Return motions that follow each other."""
    return Motion(
        np.concatenate([each.displacement_m for each in motions]),
        np.concatenate([each.acceleration for each in motions]),
    )


def noise_from_rest(amplitude_m, settle_s, realisations=2, specimen=None):
    """Return plan, base motion, m0 velocity and parts of weak noise, every realisation from rest."""
    plan = WhiteNoise(
        amplitude_vpp=0.05, band_start_hz=60.0, band_stop_hz=560.0, repetition_hz=4.0, periods=2,
        settle_s=settle_s, realisations=realisations,
    )  # fmt: skip
    lines = np.arange(plan.band_start_hz, plan.band_stop_hz + 1, plan.repetition_hz)
    played_s = plan.periods / plan.repetition_hz
    motions = [multisine(settle_s + played_s, lines, amplitude_m, seed) for seed in range(realisations)]
    velocities = [response_of(each, specimen=specimen)[0] for each in motions]
    parts = []
    for number in range(realisations):
        start_s = number * (settle_s + played_s + RAMP_S) + settle_s
        parts.append(Part("realisation", start_s, start_s + played_s, {"realisation": number}))
    return plan, joined(motions), np.concatenate(velocities), parts


def noise_band(duration_s, low_hz, high_hz, rms_m, seed):
    """Return Gaussian base motion in a band and the velocity of a mass with twice that displacement."""
    count = round(duration_s * RATE)
    omega = 2 * np.pi * np.fft.rfftfreq(count, 1 / RATE)
    inside = (omega >= 2 * np.pi * low_hz) & (omega <= 2 * np.pi * high_hz)
    rng = np.random.default_rng(seed)
    spectrum = np.where(inside, rng.standard_normal(omega.size) + 1j * rng.standard_normal(omega.size), 0)
    spectrum *= rms_m / np.std(np.fft.irfft(spectrum, count))
    base = Motion(np.fft.irfft(spectrum, count), np.fft.irfft(-(omega**2) * spectrum, count))
    return base, np.fft.irfft(2j * omega * spectrum, count)


def response_of(motion, delay_samples=0, specimen=None):
    """Return the delayed velocity of m0 under a base motion, and the impact times [s]."""
    drive = Sampled(np.append(motion.displacement_m, motion.displacement_m[-1]), RATE)
    path = integrate(
        specimen or gong2025(), drive, (motion.displacement_m.size - 1) / RATE, sample_rate_hz=RATE
    )
    return np.roll(path.states[:, 3], delay_samples), path.impacts.times_s


VELOCITY = ("m0_velocity", "velocity", "m s-1", 0.1)
"""Role, quantity, unit and unit per volt of the response."""


def header(measurement, samples, delay_s, started_utc, response=VELOCITY):
    def channel(role, quantity, unit, per_volt, **more):
        return ChannelHeader(
            role=role,
            physical_channel=f"dev/{role}",
            quantity=quantity,
            unit=unit,
            physical_per_volt=per_volt,
            range_v=10.0,
            calibration_date="2026-01-10",
            serial=f"S-{role}",
            sensitivity=1 / per_volt,
            sensitivity_unit=f"V/({unit})",
            **more,
        )

    return RecordingHeader(
        channels=(
            channel("drive_voltage", "voltage", "V", 1.0),
            channel("base_acceleration", "acceleration", "m s-2", 10.0),
            channel(*response, delay_s=delay_s),
        ),
        sample_rate_hz=RATE,
        expected_samples=samples,
        origin=Origin.SIMULATED,
        plan_json=measurement.model_dump_json(),
        bench_json=json.dumps(BENCH),
        instruments={"generator": Identity("MAKER", "GEN", "G-7", "1.0", "MAKER,GEN,G-7,1.0")},
        confirmations={"operator": "somebody", "amplifier gain": "10 dB"},
        provenance=replace(PROVENANCE, started_utc=started_utc),
    )


def write_sweep(folder, amplitude_m, sweep, specimen=None, noise=0.0, seed=1):
    """Write a sweep with the numbers of its plan; return its file and the impact times [s]."""
    motion = chirp(sweep["duration_s"], sweep["start_hz"], sweep["stop_hz"], amplitude_m)
    velocity, impacts_s = response_of(motion, specimen=specimen)
    velocity = velocity + noise * np.random.default_rng(seed).standard_normal(velocity.size)
    plan = SineSweep(amplitude_vpp=2 * VOLTS_PER_METRE * amplitude_m, settle_s=0.0, **sweep)
    part = Part("sweep", 0.0, sweep["duration_s"], {"start_hz": sweep["start_hz"]})
    return write_recording(folder, plan, motion, velocity, [part], name="sweep"), impacts_s


def write_recording(*recorded, state=RecordingState.COMPLETE, reason="the plan was carried out", **how):
    """Write a recording of the arguments of `start_recording`."""
    return start_recording(*recorded, **how).finish(state, reason)


def start_recording(
    folder: Path,
    excitation,
    motion,
    velocity,
    parts,
    *,
    name="run",
    hole=None,
    samples=None,
    delay_s=0.0,
    started_utc=PROVENANCE.started_utc,
    overloads=(),
    response=VELOCITY,
):
    """Begin a recording and append its samples; return the writer, not yet finished.

    ``velocity`` holds the samples of the channel ``response``; ``hole`` is a range of lost samples, and
    ``samples`` shortens the record.
    """
    planned = velocity.size
    kept = planned if samples is None else samples
    measurement = Measurement(name=name, excitation=excitation)
    drive = VOLTS_PER_METRE * motion.displacement_m
    volts = np.stack((drive, motion.acceleration / 10.0, velocity / response[3]))
    edges = {0, kept}
    for each in parts:
        edges |= {min(round(each.start_s * RATE), kept), min(round(each.stop_s * RATE), kept)}
    if hole is not None:
        edges |= set(hole)
    starts = {round(each.start_s * RATE): each for each in parts}
    stops = {round(each.stop_s * RATE) for each in parts}
    writer = create_recording(
        folder / f"{name}.h5", header(measurement, planned, delay_s, started_utc, response)
    )
    ordered = sorted(edges)
    for begin, end in zip(ordered, [*ordered[1:], kept], strict=True):
        if begin in stops:
            writer.end_segment()
        if begin in starts and begin < kept:
            writer.begin_segment(starts[begin].label, **starts[begin].numbers)
        if hole is not None and hole[0] <= begin < hole[1]:
            continue
        if end > begin:
            inside = tuple(each for each in overloads if begin <= each.first_sample < end)
            writer.append(Block(begin, volts[:, begin:end], inside))
    return writer
