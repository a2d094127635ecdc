"""Samples as sound: 32-bit WAV in which each channel's full scale is 1, for ears and sound programs."""

import wave
from pathlib import Path

import numpy as np

from ..errors import InvalidRequest
from ._excerpt import Excerpt, Watcher, unwatched

BYTES = 4
LARGEST_BYTES = 2**32 - 1024
"""A WAV file counts its bytes with 32 bits, heading included."""
FULL_COUNT = 2**31


def require_sound(excerpt: Excerpt) -> None:
    """InvalidRequest when the rate is no whole number, or the samples are too many for a WAV file."""
    rate = excerpt.recording.sample_rate_hz
    if rate != round(rate):
        raise InvalidRequest(
            f"{excerpt.recording.path.name} has {rate!r} samples/s, and a WAV file can only say whole "
            "numbers; export it as uff, csv or mat"
        )
    size = excerpt.values * BYTES
    if size >= LARGEST_BYTES:
        raise InvalidRequest(
            f"{excerpt.samples} samples of {len(excerpt.channels)} channels make {size / 2**30:.1f} GiB, and "
            "a WAV file ends at 4 GiB; export fewer seconds, or fewer channels"
        )


def write_wav(excerpt: Excerpt, path: Path, watcher: Watcher = unwatched) -> None:
    """Write all channels, a block at a time; lost samples are silent, and past full scale is full scale.

    Counts of a converter of up to 32 bits stay exact: only zeros are put behind them.
    """
    full_scales = np.array([[abs(each.physical_per_volt) * each.range_v] for each in excerpt.channels])
    with path.open("xb") as raw, wave.open(raw, "wb") as file:
        file.setnchannels(len(excerpt.channels))
        file.setsampwidth(BYTES)
        file.setframerate(round(excerpt.recording.sample_rate_hz))
        file.setnframes(excerpt.samples)
        for block in excerpt.blocks():
            counts = np.rint(np.nan_to_num(block.values) / full_scales * FULL_COUNT)
            inside = np.clip(counts, -FULL_COUNT, FULL_COUNT - 1)
            file.writeframesraw(inside.T.astype("<i4").tobytes())
            watcher(block.values.size)
