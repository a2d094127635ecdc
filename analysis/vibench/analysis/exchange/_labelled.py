"""Samples for other Python packages: SEP 005 dictionaries for SDyPy, and a labelled xarray.Dataset."""

import json
from collections.abc import Sequence
from dataclasses import asdict
from datetime import datetime, timedelta
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vibench.acquisition.recording import ChannelHeader, Recording

from ..errors import InvalidRequest
from ..recordings.facts import require_checked
from ._excerpt import Excerpt, excerpt

if TYPE_CHECKING:
    import xarray

QUANTITIES = {"velocity": "v", "acceleration": "a", "displacement": "d", "force": "f"}


def sep005(excerpt: Excerpt) -> list[dict[str, Any]]:
    """Return the channels of an excerpt in the form that SDyPy packages read; lost samples are NaN.

    Parameters
    ----------
    excerpt
        Excerpt of an open recording.

    Returns
    -------
    list of dict
        For each channel: ``data``, shape (samples,), ``name``, ``unit_str``, ``fs`` [Hz], ``quantity`` if SEP
        005 defines a letter for it, ``start_timestamp`` of the first sample, and ``group``: the recording.
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


BETWEEN = -1
"""Segment number of samples outside all segments."""


def xarray_dataset(
    recording: Recording,
    roles: Sequence[str] = (),
    from_s: float | None = None,
    to_s: float | None = None,
) -> "xarray.Dataset":
    """Return channels in physical units over ``time`` [s since the first sample], in memory.

    Lost samples are NaN. ``segment`` is the segment number of each sample, -1 between segments; the attribute
    ``segments_json`` describes the segments. A finished file that is larger than memory can be opened
    directly: ``xarray.open_dataset(path, engine="h5netcdf")``.

    Raises InvalidRequest when xarray is not installed, or the stretch is outside the recording; UnusableData
    when the recording was changed after it was sealed.

    Parameters
    ----------
    recording
        An open recording; it may be closed afterwards.
    roles
        Channels; by default all.
    from_s, to_s
        Start and end of the stretch [s]; by default the whole recording.
    """
    try:
        import xarray  # noqa: PLC0415 - an optional extra
    except ImportError as error:
        raise InvalidRequest("xarray is not installed; pip install 'vibench[exchange]'") from error
    require_checked(recording)
    chosen = excerpt(recording, roles, from_s, to_s)
    time_s = recording.time_s(chosen.start, chosen.stop)
    return xarray.Dataset(
        {
            each.role: ("time", recording.read(each.role, chosen.start, chosen.stop), _attributes(each))
            for each in chosen.channels
        },
        coords={
            "time": ("time", time_s, {"units": "s", "long_name": "time since the first sample"}),
            "segment": ("time", _numbers_of_segments(recording, chosen.start, chosen.stop)),
        },
        attrs={
            "recording": chosen.name,
            "recording_id": recording.recording_id,
            "sample_rate_hz": recording.sample_rate_hz,
            "started_utc": recording.started_utc,
            "origin": recording.origin.value,
            "state": recording.state.value,
            "segments_json": json.dumps(
                [{"label": each.label, **each.numbers} for each in recording.segments]
            ),
        },
    )


def _attributes(channel: ChannelHeader) -> dict[str, str | float]:
    known = {name: value for name, value in asdict(channel).items() if value not in {None, ""}}
    del known["role"], known["unit"]
    return {"units": channel.unit, "long_name": channel.role.replace("_", " "), **known}


def _numbers_of_segments(recording: Recording, start: int, stop: int) -> NDArray[np.int16]:
    """Return the segment number of each sample, -1 between segments."""
    numbers = np.full(stop - start, BETWEEN, dtype=np.int16)
    for number, each in enumerate(recording.segments):
        numbers[max(each.start - start, 0) : max(each.stop - start, 0)] = number
    return numbers
