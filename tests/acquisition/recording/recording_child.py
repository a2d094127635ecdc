"""A program that records until it is killed, and prints how many samples it has handed over.

With arguments (path of the recording, number of blocks) it records once. Without arguments it records
repeatedly, as the JSON lines on its standard input say, each time in a forked process: a fork takes
milliseconds, a new interpreter a second.
"""

import json
import os
import signal
import sys
import threading
import time

import numpy as np

from vibench.acquisition import Block
from vibench.acquisition.recording import (
    ChannelHeader,
    Origin,
    RecordingHeader,
    RecordingState,
    create_recording,
)

RATE_HZ = 51_200.0
BLOCK = 512
STEP_V = 5.0 / 2**23
SPREAD = 2_654_435_761
COUNTER_BYTES = 8


def truth(first, stop, row):
    """Return 24-bit counts that depend on sample number and row only, without a short repeating pattern."""
    hashed = (np.arange(first, stop, dtype=np.int64) * (2 * row + 1) * SPREAD) % 2**24
    return (hashed - 2**23).astype(np.int32)


class DeadlyDisk:
    """A disk that kills its process at the n-th step of a commit: a sync, or the write of a counter."""

    def __init__(self, disk, step):
        self._disk = disk
        self._left = step

    def write(self, offset, data):
        self._disk.write(offset, data)
        if len(data) == COUNTER_BYTES:
            self._step()

    def sync(self):
        self._step()
        self._disk.sync()

    def reserve(self, offset, size):
        self._disk.reserve(offset, size)

    def close(self):
        self._disk.close()

    def _step(self):
        self._left -= 1
        if self._left == 0:
            os.write(1, f"committing {time.monotonic()}\n".encode())
            os.kill(os.getpid(), signal.SIGKILL)


def record(path, blocks, commit_step=None, blocks_per_s=None):
    channels = tuple(
        ChannelHeader(role, "ai0", "voltage", "V", 1.0, 5.0, STEP_V) for role in ("drive", "response")
    )
    header = RecordingHeader(channels, RATE_HZ, blocks * BLOCK, Origin.SIMULATED)
    writer = create_recording(path, header)
    if commit_step is not None:
        writer._committer._disk = DeadlyDisk(writer._committer._disk, commit_step)
    pace, began_s = threading.Event(), time.monotonic()
    for index in range(blocks):
        first = index * BLOCK
        counts = np.stack([truth(first, first + BLOCK, row) for row in range(2)])
        writer.append(Block(first, counts * STEP_V))
        os.write(1, f"{time.monotonic()} {first + BLOCK}\n".encode())
        if blocks_per_s is not None:
            pace.wait(max(0.0, began_s + index / blocks_per_s - time.monotonic()))
    os.write(1, b"finishing\n")
    writer.finish(RecordingState.COMPLETE)
    os.write(1, b"finished\n")


def serve():
    while line := sys.stdin.readline():
        pid = os.fork()
        if pid == 0:
            record(**json.loads(line))
            os._exit(0)
        os.write(1, f"pid {pid}\n".encode())
        os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
        os.write(1, b"ended\n")
        sys.stdin.readline()  # until then the number is not reused, so that no other process can be killed
        os.waitpid(pid, 0)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        record(sys.argv[1], int(sys.argv[2]))
    else:
        serve()
