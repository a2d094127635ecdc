"""Measure the time to open and draw a recording of half a gigabyte, against reading whole channels.

    python benchmarks/overview.py [MINUTES] [FOLDER]

The recording has 4 channels at 51.2 kS/s with 20 bits of noise, and is written by vibench. Times are elapsed
times of one thread, with the file in the page cache. For every zoom, five pictures at random places are
drawn.
"""

import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from vibench.acquisition import Block, open_recording
from vibench.acquisition.plan import Measurement, StreamedNoise
from vibench.acquisition.recording import (
    ChannelHeader,
    Origin,
    OverviewSums,
    RecordingHeader,
    create_recording,
)
from vibench.analysis.live import envelope
from vibench.analysis.live._outline import overview_of

RATE_HZ = 51_200
COLUMNS = 1000
RANGE_V, STEP_V = 10.0, 20.0 / 2**24
ROLES = ("drive_voltage", "amplifier_voltage", "base_acceleration", "m0_velocity")
UNITS = (("voltage", "V"), ("voltage", "V"), ("acceleration", "m s-2"), ("velocity", "m s-1"))
ZOOMS_S = (600.0, 60.0, 6.0, 2.5, 2.4, 0.6, 0.06, 0.001)


def main() -> None:
    """Write the recording if it does not exist, open it and draw it."""
    minutes = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(sys.argv[2]) if len(sys.argv) > 2 else Path(temporary)
        path = folder / f"overview_{minutes:g}min.h5"
        samples = round(60 * minutes * RATE_HZ)
        if not path.exists():
            write(path, samples)
        megabytes = 4 * len(ROLES) * samples / 1e6
        on_disk = path.stat().st_size / 1e6
        print(f"{samples} samples x {len(ROLES)}: {megabytes:.0f} MB of counts, {on_disk:.0f} MB")
        look(path, minutes)


def write(path: Path, samples: int) -> None:
    """Write a recording with noise of 20 bits."""
    plan = StreamedNoise(
        amplitude_vpp=10.0, band_start_hz=20, band_stop_hz=2000, settle_s=0.0, duration_s=600.0, seed=1
    )
    header = RecordingHeader(
        channels=tuple(
            ChannelHeader(role, f"dev/{role}", quantity, unit, 1.0, RANGE_V, STEP_V)
            for role, (quantity, unit) in zip(ROLES, UNITS, strict=True)
        ),
        sample_rate_hz=float(RATE_HZ),
        expected_samples=samples,
        origin=Origin.SIMULATED,
        plan_json=Measurement(name="long", excitation=plan).model_dump_json(),
        bench_json=json.dumps({"name": "benchmark"}),
    )
    rng = np.random.default_rng(1)
    with create_recording(path, header) as writer:
        for first in range(0, samples, RATE_HZ * 5):
            count = min(RATE_HZ * 5, samples - first)
            counts = np.rint(rng.normal(0, 2**17, (len(ROLES), count)))
            writer.append(Block(first, counts * STEP_V))
        print("written; finishing it makes the overview")
        begun = time.perf_counter()
    print(f"finished in {time.perf_counter() - begun:.1f} s")


def look(path: Path, minutes: float) -> None:
    """Open the file and print the times to draw pictures of it."""
    begun = time.perf_counter()
    with open_recording(path) as recording:
        overview = overview_of(recording)
        picture = overview.picture(ROLES, 0, recording.samples, COLUMNS)
        print(f"open and first picture ({picture.samples_per_column:.0f} samples a column): {_ms(begun)}")
        rng = np.random.default_rng(2)
        for span_s in (each for each in ZOOMS_S if each <= 60 * minutes):
            count = round(span_s * RATE_HZ)
            taken = []
            for _ in range(5):
                start = int(rng.integers(0, recording.samples - count + 1))
                begun = time.perf_counter()
                overview.picture(ROLES, start, start + count, COLUMNS)
                taken.append(time.perf_counter() - begun)
            median_ms, largest_ms = 1e3 * float(np.median(taken)), 1e3 * max(taken)
            print(f"zoom to {span_s:g} s: median {median_ms:.1f} ms, largest {largest_ms:.1f} ms")
        begun = time.perf_counter()
        sums = OverviewSums()
        for first in range(0, recording.samples, 20 * RATE_HZ):
            sums.add(recording.read_counts(ROLES[0], first, min(first + 20 * RATE_HZ, recording.samples)))
        sums.overview()
        print(f"without a kept overview, making it: {len(ROLES)} x {_ms(begun)}")
        begun = time.perf_counter()
        envelope(recording.read(ROLES[3]), COLUMNS)
        print(f"reading one whole channel and drawing it: {_ms(begun)} for each of {len(ROLES)}")


def _ms(begun: float) -> str:
    return f"{1e3 * (time.perf_counter() - begun):.0f} ms"


if __name__ == "__main__":
    main()
