"""Compare speed and memory of the averaged spectra with scipy on the whole arrays.

Run as ``python benchmarks/transmission.py [MINUTES]``. Each of the two programs runs in a separate process,
so that its peak memory can be measured. The recording (4 channels at 51.2 kS/s) is in a file, as in the
laboratory.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy import signal
from separate_process import run_separately

from vibench.analysis.spectra import SegmentSpectra

RATE_HZ = 51_200
CHANNELS = 4
SEGMENT = 51_200
BLOCK = 1 << 19


def channel_file(folder, channel):
    """Return the path of the file of one channel."""
    return folder / f"channel{channel}.f64"


def write_recording(folder, samples):
    """Write noise, one file per channel."""
    rng = np.random.default_rng(1)
    for channel in range(CHANNELS):
        with channel_file(folder, channel).open("wb") as file:
            for first in range(0, samples, BLOCK):
                rng.standard_normal(min(BLOCK, samples - first)).tofile(file)


def run_vibench(folder, samples):
    """Average all ten spectra and cross-spectra of four channels, block by block."""
    spectra = SegmentSpectra(CHANNELS, SEGMENT)
    for first in range(0, samples, BLOCK):
        count = min(BLOCK, samples - first)
        rows = [
            np.fromfile(channel_file(folder, channel), np.float64, count, offset=first * np.float64().nbytes)
            for channel in range(CHANNELS)
        ]
        spectra.add(np.stack(rows))
    return spectra.averages().density(0, 1, RATE_HZ)


def run_scipy(folder, _samples):
    """Average the same ten spectra with scipy, on the whole arrays in memory."""
    record = [np.fromfile(channel_file(folder, channel), np.float64) for channel in range(CHANNELS)]
    settings = {"fs": RATE_HZ, "nperseg": SEGMENT, "detrend": False}
    result = None
    for i in range(CHANNELS):
        signal.welch(record[i], **settings)
        for j in range(i + 1, CHANNELS):
            _, cross = signal.csd(record[i], record[j], **settings)
            result = cross if (i, j) == (0, 1) else result
    return result


def main():
    """Run both programs and print time, memory and agreement."""
    minutes = float(sys.argv[1]) if len(sys.argv) > 1 else 3.0
    samples = int(minutes * 60 * RATE_HZ)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_recording(folder, samples)
        ours = run_separately(run_vibench, folder, samples)
        theirs = run_separately(run_scipy, folder, samples)
    difference = np.max(np.abs(ours.result / theirs.result - 1))
    print(f"{minutes:g} minutes of {CHANNELS} channels, segments of {SEGMENT}, all spectra and cross-spectra")
    for name, run in (("vibench:", ours), ("scipy:", theirs)):
        print(f"{name:8} {run.wall_s:6.2f} s, {run.peak_mb - run.idle_mb:7.0f} MB above the idle process")
    ratio = theirs.wall_s / ours.wall_s
    print(f"scipy takes {ratio:.1f} times as long; largest relative difference {difference:.1e}")


if __name__ == "__main__":
    main()
