"""Samples as comma-separated text: one row a sample, headings with units, nothing before them."""

import csv
from pathlib import Path

import numpy as np

from ._excerpt import Excerpt, Watcher, unwatched

TIME_FORMAT = "%.9f"
"""Nanoseconds since the recording's first sample."""
VALUE_FORMAT = "%.10g"
"""One more digit than 2^-30 of the range needs; lost samples read ``nan``."""


def write_csv_samples(excerpt: Excerpt, path: Path, watcher: Watcher = unwatched) -> None:
    """Write time and channels, a block at a time."""
    headings = ["time [s]", *(f"{each.role} [{each.unit}]" for each in excerpt.channels)]
    row = ",".join([TIME_FORMAT, *(VALUE_FORMAT for _ in excerpt.channels)]) + "\n"
    rate = excerpt.recording.sample_rate_hz
    with path.open("x", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerow(headings)
        for block in excerpt.blocks():
            samples = block.values.shape[1]
            time_s = np.arange(block.first_sample, block.first_sample + samples) / rate
            cells = np.column_stack((time_s, block.values.T))
            file.write(row * samples % tuple(cells.ravel().tolist()))
            watcher(block.values.size)
