"""Samples as the exchange format of SDyPy: a dictionary for each channel, after SEP 005."""

from datetime import datetime, timedelta
from typing import Any

import numpy as np

from ._excerpt import Excerpt

QUANTITIES = {"velocity": "v", "acceleration": "a", "displacement": "d", "force": "f"}


def sep005(excerpt: Excerpt) -> list[dict[str, Any]]:
    """Return the channels of an excerpt as SDyPy's packages expect them; lost samples are NaN.

    Parameters
    ----------
    excerpt
        Result of `excerpt` for an open recording.

    Returns
    -------
    list of dict
        For each channel ``data``, shape (samples,), ``name``, ``unit_str``, ``fs`` [Hz], ``quantity`` if SEP
        005 defines a letter for it, ``start_timestamp`` of the first sample, and ``group``, the recording.
    """
    recording = excerpt.recording
    rate = recording.sample_rate_hz
    start = datetime.fromisoformat(recording.started_utc) + timedelta(seconds=excerpt.start / rate)
    return [
        {
            "data": np.concatenate(list(excerpt.channel_blocks(channel.role))),
            "name": channel.role,
            "unit_str": channel.unit,
            "fs": rate,
            **({"quantity": QUANTITIES[channel.quantity]} if channel.quantity in QUANTITIES else {}),
            "start_timestamp": start.isoformat(),
            "group": excerpt.name,
        }
        for channel in excerpt.channels
    ]
