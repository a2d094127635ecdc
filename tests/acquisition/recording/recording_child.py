"""A program that records until it is killed, and says on its standard output what it has handed over.

Arguments: the path of the recording, and how many blocks to record before finishing.
"""

import os
import sys
import time

import numpy as np

from acquisition.instruments import Block
from acquisition.recording import ChannelHeader, Origin, RecordingHeader, RecordingState, create_recording

RATE_HZ = 51_200.0
BLOCK = 512
STEP_V = 5.0 / 2**23
SPREAD = 2_654_435_761


def truth(first, stop, row):
    """Counts that anybody can compute from the sample's number: full 24 bits, no pattern a shift repeats."""
    hashed = (np.arange(first, stop, dtype=np.int64) * (2 * row + 1) * SPREAD) % 2**24
    return (hashed - 2**23).astype(np.int32)


def main(path, blocks):
    channels = tuple(
        ChannelHeader(role, "ai0", "voltage", "V", 1.0, 5.0, STEP_V) for role in ("drive", "response")
    )
    header = RecordingHeader(channels, RATE_HZ, blocks * BLOCK, Origin.SIMULATED)
    writer = create_recording(path, header)
    for index in range(blocks):
        first = index * BLOCK
        counts = np.stack([truth(first, first + BLOCK, row) for row in range(2)])
        writer.append(Block(first, counts * STEP_V))
        os.write(1, f"{time.monotonic()} {first + BLOCK}\n".encode())
    os.write(1, b"finishing\n")
    writer.finish(RecordingState.COMPLETE)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
