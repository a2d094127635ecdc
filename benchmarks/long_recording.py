"""Compare speed and memory of the analysis of a long recording with scipy on the whole arrays.

Run as ``python benchmarks/long_recording.py [MINUTES]``. The recording has 4 channels at 51.2 kS/s and is
written by vibench: streamed noise through a resonator, with converter noise on every channel. Each of the two
analyses runs in a separate process, so that its peak memory can be measured.
"""

import json
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy import signal
from separate_process import MEGABYTE, run_separately

from vibench.acquisition import Block, open_recording
from vibench.acquisition.plan import Measurement, StreamedNoise
from vibench.acquisition.recording import (
    ChannelHeader,
    Origin,
    RecordingHeader,
    RecordingState,
    create_recording,
)
from vibench.acquisition.rig import RESPONSE_ROLES
from vibench.analysis import analyse
from vibench.analysis.recordings.channels import BASE, DRIVE

RATE_HZ = 51_200
BLOCK = 1 << 19
SEGMENT_S = 4.0
RESONANCE_HZ, DAMPING = 266.0, 0.01
CONVERTER_NOISE = 1e-4
RANGE_V = 10.0
STEP_V = 2 * RANGE_V / 2**24
"""Voltage step of a 24-bit converter [V]."""
RESPONSE = RESPONSE_ROLES[0].value
PER_VOLT = {DRIVE: 1.0, BASE: 10.0, RESPONSE: 0.1, "table_acceleration": 10.0}
UNITS = {
    DRIVE: ("voltage", "V"),
    BASE: ("acceleration", "m s-2"),
    RESPONSE: ("velocity", "m s-1"),
    "table_acceleration": ("acceleration", "m s-2"),
}


def header(plan, samples):
    """Return the header of a recording with four channels of a 24-bit converter."""
    return RecordingHeader(
        channels=tuple(
            ChannelHeader(
                role=role,
                physical_channel=f"dev/{role}",
                quantity=UNITS[role][0],
                unit=UNITS[role][1],
                physical_per_volt=per_volt,
                range_v=RANGE_V,
                volts_per_count=STEP_V,
            )
            for role, per_volt in PER_VOLT.items()
        ),
        sample_rate_hz=float(RATE_HZ),
        expected_samples=samples,
        origin=Origin.SIMULATED,
        plan_json=Measurement(name="long", excitation=plan).model_dump_json(),
        bench_json=json.dumps({"name": "benchmark"}),
    )


def write_recording(path, duration_s):
    """Write a recording of noise: the base equals the drive, the response is the base after a resonator."""
    plan = StreamedNoise(
        amplitude_vpp=10.0, band_start_hz=20, band_stop_hz=2000, settle_s=0.0, duration_s=duration_s, seed=1
    )
    samples = round(duration_s * RATE_HZ)
    rng = np.random.default_rng(1)
    omega = 2 * np.pi * RESONANCE_HZ
    section = signal.bilinear([omega, 0.0], [1.0, 2 * DAMPING * omega, omega**2], fs=RATE_HZ)
    state = np.zeros(2)
    with create_recording(path, header(plan, samples)) as writer:
        writer.begin_segment("noise")
        for first in range(0, samples, BLOCK):
            drive = rng.standard_normal(min(BLOCK, samples - first))
            response, state = signal.lfilter(*section, drive, zi=state)
            volts = np.stack((drive, drive, response, drive))
            volts += CONVERTER_NOISE * rng.standard_normal(volts.shape)
            writer.append(Block(first, STEP_V * np.round(volts / STEP_V)))
        writer.end_segment()
        writer.finish(RecordingState.COMPLETE, "the plan was carried out")


def run_vibench(path):
    """Analyse the recording as `vibench analyse` does: levels, checks, three estimates, resonances."""
    with open_recording(path) as recording:
        found = analyse(recording).response.h1
    return found.frequency_hz, found.magnitude


def run_scipy(path):
    """Compute with scipy only the six spectra that these estimates need, from whole channels."""
    with open_recording(path) as recording:
        drive, base, response = (recording.read(role) for role in (DRIVE, BASE, RESPONSE))
    how = {"fs": RATE_HZ, "nperseg": round(SEGMENT_S * RATE_HZ), "detrend": False}
    frequency_hz, s_xx = signal.welch(base, **how)
    signal.welch(response, **how)
    signal.welch(drive, **how)
    _, s_xy = signal.csd(base, response, **how)
    signal.csd(drive, base, **how)
    signal.csd(drive, response, **how)
    # Convert velocity over acceleration to displacement over displacement.
    return frequency_hz, np.abs(s_xy / s_xx) * 2 * np.pi * frequency_hz


def compare(path):
    """Run both on one recording and print time, memory and agreement."""
    ours, theirs = run_separately(run_vibench, path), run_separately(run_scipy, path)
    for name, run in (("vibench:", ours), ("scipy:", theirs)):
        print(
            f"{name:9} {run.wall_s:6.2f} s, {run.cpu_s:6.2f} s of processor time, peak {run.peak_mb:.0f} MB "
            f"({run.idle_mb:.0f} MB before it began)"
        )
    (frequency_hz, magnitude), (their_hz, theirs_magnitude) = ours.result, theirs.result
    lines = np.searchsorted(their_hz, frequency_hz - 1e-9)
    difference = np.max(np.abs(magnitude / theirs_magnitude[lines] - 1))
    ratio = theirs.cpu_s / ours.cpu_s
    print(f"scipy takes {ratio:.2f} times the processor time; h1 differs by {difference:.1e} at most")


def main():
    """Write a temporary recording and compare both analyses of it."""
    minutes = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "long.h5"
        write_recording(path, 60.0 * minutes)
        counts = 4 * len(PER_VOLT) * minutes * 60 * RATE_HZ / MEGABYTE
        size = path.stat().st_size / MEGABYTE
        print(
            f"{minutes:g} minutes, {len(PER_VOLT)} channels: {counts:.0f} MB of counts, {size:.0f} MB on disk"
        )
        compare(path)


if __name__ == "__main__":
    main()
