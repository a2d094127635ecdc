"""Recordings of the virtual rig with noise, and the true motion that no sensor measured."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vibench.acquisition import Block, Identity
from vibench.acquisition.plan import Dwell, Measurement
from vibench.acquisition.recording import (
    ChannelHeader,
    Origin,
    RecordingHeader,
    RecordingState,
    create_recording,
)
from vibench.acquisition.rig import Rig, channels_of, load_rig, specimen_of
from vibench.sim import Specimen
from vibench.virtual_rig.world.conversion import Coupling, Input
from vibench.virtual_rig.world.world import World

RIG = load_rig("virtual_rig")
GRID_HZ = 102_400.0
GROUP_DELAY = 39
"""Delay of the simulated converter behind the time grid [samples]."""
RAMP_S = 0.3
SCORED_FROM_S = 0.4


class Played:
    """A generator output that plays samples on the simulation's time grid and is zero afterwards."""

    def __init__(self, volts):
        self.volts = volts

    def render(self, start_s, interval_s, count):
        first = round(start_s / interval_s)
        out = np.zeros(count)
        part = self.volts[first : first + count]
        out[: part.size] = part
        return out


def drive(kind, level_vpp, duration_s, seed):
    """Return the drive [V] of a sine, a sweep or random noise in 50 to 600 Hz, ramped up from zero."""
    time_s = (np.arange(int(duration_s * GRID_HZ)) + 0.5) / GRID_HZ
    match kind:
        case float():
            volts = np.sin(2 * np.pi * kind * time_s)
        case "sweep":
            volts = np.sin(2 * np.pi * (235 * time_s + 60 / duration_s * time_s**2 / 2))
        case "noise":
            frequency = np.fft.rfftfreq(time_s.size, 1 / GRID_HZ)
            inside = (frequency >= 50) & (frequency <= 600)
            turn = np.exp(2j * np.pi * np.random.default_rng(seed).random(frequency.size))
            volts = np.fft.irfft(np.where(inside, turn, 0), time_s.size)
            volts /= np.abs(volts).max()
    ramp = 0.5 * (1 - np.cos(np.pi * np.clip(time_s / RAMP_S, 0, 1)))
    return 0.5 * level_vpp * volts * ramp


@dataclass(frozen=True)
class ShakenRecording:
    """A recording and the true motion."""

    path: Path
    specimen: Specimen
    p: np.ndarray
    """True p at the recording's samples [m]."""
    touches: np.ndarray
    """Beginning of each contact, as a fractional sample number."""
    middles: np.ndarray
    """Middle of each contact, as a fractional sample number."""


def noisy(times, seed, dropouts_per_s=0.0):
    """Return the rig with all noise multiplied by ``times`` and a rate of vibrometer drop-outs."""
    virtual = RIG.virtual.model_copy(
        update={
            "seed": seed,
            "vibrometer_dropouts_per_s": dropouts_per_s,
            "accelerometer_noise_m_per_s2": times * RIG.virtual.accelerometer_noise_m_per_s2,
            "vibrometer_noise_m_per_s_per_rthz": times * RIG.virtual.vibrometer_noise_m_per_s_per_rthz,
            "converter_noise_v": times * RIG.virtual.converter_noise_v,
        }
    )
    return RIG.model_copy(update={"virtual": virtual})


def with_sensor(rig, role):
    """Return the rig with a further sensor in place of the amplifier voltage channel."""
    said = rig.model_dump(mode="json")
    (wire,) = [each for each in said["daq"]["channels"] if each["role"] == "amplifier_voltage"]
    wire.update(role=role, attenuation=1.0, range_v=5.0)
    sheets = {"velocity": ("250 mm/s/V", 1e-7), "acceleration": ("10 mV/g", 3e-5)}
    sensitivity, noise = sheets[role.partition("_")[2]]
    said["sensors"][role] = {
        "model": role, "sensitivity": sensitivity, "full_scale_v": 5.0, "calibrated": "2026-02-10",
        "noise_per_rthz": {"value": noise, "source": "test"},
    }  # fmt: skip
    return Rig.model_validate(said)


def contacts(p, gaps_m):
    """Return the beginning and end of each contact in grid steps, in the order of time."""
    found = []
    for side, gap in zip((-1, 1), gaps_m, strict=True):
        depth = side * p - gap
        begins = np.flatnonzero((depth[:-1] <= 0) & (depth[1:] > 0))
        ends = np.flatnonzero((depth[:-1] > 0) & (depth[1:] <= 0))
        for begin in begins:
            end = ends[ends > begin][:1]
            if end.size:
                inside = begin + depth[begin] / (depth[begin] - depth[begin + 1])
                outside = end[0] + depth[end[0]] / (depth[end[0]] - depth[end[0] + 1])
                found.append((inside, outside))
    return np.array(sorted(found)).reshape(-1, 2)


def header(rig, rate_hz, samples):
    channels = tuple(
        ChannelHeader(
            role=each.role.value,
            physical_channel=each.physical,
            quantity=each.quantity,
            unit=each.unit,
            physical_per_volt=each.units_per_volt,
            range_v=each.range_v,
            coupling=each.coupling,
            delay_s=each.delay_s,
        )
        for each in channels_of(rig)
    )
    plan = Measurement(
        name="shaken", excitation=Dwell(amplitude_vpp=1.5, frequency_hz=260, settle_s=0.5, duration_s=1.0)
    )
    return RecordingHeader(
        channels=channels,
        sample_rate_hz=rate_hz,
        expected_samples=samples,
        origin=Origin.SIMULATED,
        plan_json=plan.model_dump_json(),
        bench_json=rig.model_dump_json(),
        instruments={"generator": Identity("MAKER", "GEN", "G-7", "1.0", "MAKER,GEN,G-7,1.0")},
    )


def shake(
    folder,
    kind,
    level_vpp,
    *,
    duration_s=1.6,
    seed=1,
    noise=1.0,
    dropouts_per_s=0.0,
    rate_hz=51_200.0,
    specimen=None,
    further=None,
    overflow=math.inf,
):
    """Simulate a specimen on the virtual rig and write the converter's samples as a recording.

    The last channel overflows beyond ``overflow`` times its largest value.
    """
    rig = noisy(noise, seed, dropouts_per_s)
    if further is not None:
        rig = with_sensor(rig, further)
    world = World(rig, Played(drive(kind, level_vpp, duration_s, seed)), specimen)
    world.keep_truth()
    inputs = tuple(
        Input(f"{rig.daq.device}/{each.physical}", each.range_v, Coupling(each.coupling), each.iepe_current_a)
        for each in rig.daq.channels
    )
    count = int(duration_s * rate_hz)
    volts = world.sample(inputs, rate_hz).read(count)
    if math.isfinite(overflow):
        most_v = overflow * np.abs(volts[-1]).max()
        volts[-1] = (volts[-1] + most_v) % (2 * most_v) - most_v
    truth = world.truth()
    steps = GRID_HZ / rate_hz
    # Row n of the truth is the end of step n.
    p = truth[:, 4] - truth[:, 5]
    rows = ((np.arange(count) - GROUP_DELAY) * steps - 1).astype(int)
    moved = specimen or specimen_of(rig)
    met = (contacts(p, moved.gaps_m) + 1) / steps + GROUP_DELAY
    begin = round(SCORED_FROM_S * rate_hz)
    writer = create_recording(folder / "shaken.h5", header(rig, rate_hz, count))
    writer.append(Block(0, volts[:, :begin]))
    writer.begin_segment("dwell", frequency_hz=260.0)
    writer.append(Block(begin, volts[:, begin:]))
    writer.end_segment()
    path = writer.finish(RecordingState.COMPLETE, "the plan was carried out")
    at_samples = np.where(rows >= 0, p[np.maximum(rows, 0)], 0.0)
    return ShakenRecording(path, moved, at_samples, met[:, 0], met.mean(axis=1))
