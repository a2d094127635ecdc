"""Measure the cost of a recording's seal, compared with finishing and with reading the recording.

    python benchmarks/cost_of_seals.py [--minutes 10]

Four channels of noise at 51.2 kS/s are recorded as fast as the disk allows. Finishing is timed with the seal,
and without it (then only the samples are read back). A quick check and a whole check of the seal, and plain
reading of all samples, are also timed. The shortest of three runs counts.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from unittest import mock

import numpy as np

from vibench.acquisition import Block, open_recording
from vibench.acquisition.recording import (
    ChannelHeader,
    Origin,
    RecordingHeader,
    RecordingState,
    SealDepth,
    _finalise,
    create_recording,
)
from vibench.acquisition.recording._seal import SealCheck, SealState

RATE_HZ = 51_200.0
STEP_V = 5.0 / 2**23
RUNS = 3
ROLES = ("drive_voltage", "base_acceleration", "m0_velocity", "extra")


def finishing_s(path: Path, minutes: float) -> float:
    """Record noise, and return the time to finish the recording [s]."""
    channels = tuple(ChannelHeader(role, "ai0", "voltage", "V", 1.0, 5.0, STEP_V) for role in ROLES)
    samples = round(minutes * 60 * RATE_HZ)
    chance = np.random.default_rng(1)
    writer = create_recording(path, RecordingHeader(channels, RATE_HZ, samples, Origin.SIMULATED))
    block = round(RATE_HZ)
    for first in range(0, samples, block):
        counts = chance.normal(0.0, 2.0**19, (len(ROLES), min(block, samples - first))).round()
        writer.append(Block(first, counts * STEP_V))
    while writer.committed_samples < samples:
        time.sleep(0.05)
    began_s = time.perf_counter()
    writer.finish(RecordingState.COMPLETE)
    return time.perf_counter() - began_s


def least_s(action: Callable[[], object]) -> float:
    """Return the shortest time of a few runs of an action [s]."""
    taken = []
    for _ in range(RUNS):
        began_s = time.perf_counter()
        action()
        taken.append(time.perf_counter() - began_s)
    return min(taken)


def as_before_s(path: Path, minutes: float) -> float:
    """Return the time to finish a recording without a seal [s]; only its samples are read back."""
    samples_alone = SealCheck(SealState.INTACT, "", "")

    def read_back(file: object, *_: object) -> SealCheck:
        for role in ROLES:
            for begin in range(0, len(file[role]), 51_200):
                np.sum(file[role][begin : begin + 51_200])
        return samples_alone

    with mock.patch.object(_finalise, "write_seal"), mock.patch.object(_finalise, "check_seal", read_back):
        return finishing_s(path, minutes)


def main() -> None:
    """Measure and print the times."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--minutes", type=float, default=10.0, help="length of the recording")
    minutes = parser.parse_args().minutes
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder, f"{number}.h5") for number in range(2 * RUNS)]
        before_s = min(as_before_s(path, minutes) for path in paths[:RUNS])
        sealed_s = min(finishing_s(path, minutes) for path in paths[RUNS:])
        path = paths[-1]
        with open_recording(path) as recording:
            whole_s = least_s(lambda: recording.check_seal(SealDepth.WHOLE))
            quick_s = least_s(lambda: recording.check_seal(SealDepth.QUICK))
            read_s = least_s(lambda: [recording.read_counts(role).sum() for role in ROLES])
        open_s = least_s(lambda: open_recording(path).close())
        print(f"{minutes:g} min of {len(ROLES)} channels, {path.stat().st_size / 1e6:.0f} MB")
        print(
            f"finishing it took {sealed_s / before_s:.2f} times as long as without a seal ({before_s:.1f} s)"
        )
        print(f"checking the whole took {whole_s / read_s:.2f} times as long as reading it ({read_s:.1f} s)")
        print(f"a quick look took {1e3 * quick_s:.0f} ms, opening {1e3 * open_s:.0f} ms")


if __name__ == "__main__":
    main()
