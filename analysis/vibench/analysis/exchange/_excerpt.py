"""Part of a recording to export, as a labelled dataset or with its metadata in a separate file."""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime, timedelta
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vibench.acquisition.recording import ChannelHeader, RecordedBlock, Recording

from ..errors import InvalidRequest, NotEnoughData
from ..recordings.facts import require_checked
from ..signals import Reals
from ..tables import columns

BLOCK_SAMPLES = 51_200
"""Number of samples per block, as in one chunk of the file; 0.4 MB per channel."""

TransferObserver = Callable[[int], None]
"""Callback that receives the number of values written since its last call."""


def ignore_progress(_values: int) -> None:
    """Do nothing; the default observer."""


@dataclass(frozen=True, eq=False)
class Excerpt:
    """Some channels of a recording over a range of samples; :func:`excerpt` creates it."""

    recording: Recording
    channels: tuple[ChannelHeader, ...]
    start: int
    stop: int
    """Index one past the last sample of the excerpt."""

    @property
    def roles(self) -> tuple[str, ...]:
        """Names of the channels in the excerpt."""
        return tuple(each.role for each in self.channels)

    @property
    def samples(self) -> int:
        """Number of samples per channel in the excerpt."""
        return self.stop - self.start

    @property
    def values(self) -> int:
        """Total number of values of all channels, for the progress display."""
        return self.samples * len(self.channels)

    @property
    def name(self) -> str:
        """Name of the recording without suffixes."""
        return self.recording.path.name.removesuffix(".part").removesuffix(".h5")

    def blocks(self) -> Iterator[RecordedBlock]:
        """Yield blocks of samples of all channels."""
        return self.recording.blocks(self.roles, BLOCK_SAMPLES, self.start, self.stop)

    def channel_blocks(self, role: str) -> Iterator[Reals]:
        """Yield blocks of samples of one channel, in its physical unit."""
        for block in self.recording.blocks((role,), BLOCK_SAMPLES, self.start, self.stop):
            yield block.values[0]


def excerpt(
    recording: Recording,
    roles: Sequence[str] = (),
    from_s: float | None = None,
    to_s: float | None = None,
) -> Excerpt:
    """Return an excerpt with some channels (by default all) over a stretch of time.

    Parameters
    ----------
    recording
        An open recording.
    roles
        Names of the channels.
    from_s, to_s
        Start and end in seconds since the first sample; by default start and end of the recording.

    Raises
    ------
    RecordingError
        When the recording has no such channel.
    InvalidRequest
        When the stretch is outside the recording, or a channel is named twice.
    NotEnoughData
        When the recording contains no samples.
    """
    wanted = tuple(roles) or recording.roles
    if len(set(wanted)) != len(wanted):
        raise InvalidRequest(f"channels {', '.join(wanted)} were requested; name each channel only once")
    if recording.samples == 0:
        raise NotEnoughData(
            f"{recording.path.name} contains no samples ({recording.state.value}), so none can be exported"
        )
    rate = recording.sample_rate_hz
    start = 0 if from_s is None else _sample(from_s * rate)
    stop = recording.samples if to_s is None else _sample(to_s * rate)
    if not 0 <= start < stop <= recording.samples:
        raise InvalidRequest(
            f"{_moment(from_s, 'the beginning')} to {_moment(to_s, 'the end')} was requested; "
            f"{recording.path.name} covers 0 to {recording.duration_s:.9g} s; give a start and a later end"
        )
    return Excerpt(recording, tuple(recording.channel(role) for role in wanted), start, stop)


def _sample(place: float) -> int:
    """Return the index of the nearest sample; for times that are not finite, -1 (outside every recording)."""
    return round(place) if isfinite(place) else -1


def _moment(time_s: float | None, otherwise: str) -> str:
    return otherwise if time_s is None else f"{time_s:g} s"


def facts_path(path: Path) -> Path:
    """Return the path of the facts file: ``NAME.csv.facts.json`` for ``NAME.csv``."""
    return path.with_name(path.name + ".facts.json")


_ORIGIN = "origin=origin.value state=state.value"


def facts_document(excerpt: Excerpt) -> dict[str, Any]:
    """Return the facts of an excerpt; sample numbers count from the first sample of the recording."""
    recording = excerpt.recording
    return {
        "recording": excerpt.name,
        **columns(recording, f"recording_id started_utc {_ORIGIN} reason sample_rate_hz"),
        "first_sample": excerpt.start,
        "last_sample": excerpt.stop - 1,
        "channels": [
            {
                **asdict(each),
                **columns(each, "scale_factor add_offset"),
                "full_scale": abs(each.physical_per_volt) * each.range_v,
            }
            for each in excerpt.channels
        ],
        **{
            name: [asdict(each) for each in found]
            for name, found in columns(recording, "segments events overloads gaps").items()
        },
        **columns(recording, "plan bench"),
        "instruments": {name: asdict(each) for name, each in recording.instruments.items()},
        **columns(recording, "confirmations provenance bench_check"),
    }


def write_facts(excerpt: Excerpt, path: Path) -> None:
    """Write the facts of an excerpt as JSON."""
    text = json.dumps(facts_document(excerpt), indent=2, allow_nan=False, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")


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
        005 defines a letter for it, ``start_timestamp`` of the first sample, and ``group``: its recording.
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
    numbers = np.full(chosen.samples, BETWEEN, dtype=np.int16)
    for number, each in enumerate(recording.segments):
        numbers[max(each.start - chosen.start, 0) : max(each.stop - chosen.start, 0)] = number
    return xarray.Dataset(
        {
            each.role: ("time", recording.read(each.role, chosen.start, chosen.stop), _attributes(each))
            for each in chosen.channels
        },
        coords={
            "time": ("time", time_s, {"units": "s", "long_name": "time since the first sample"}),
            "segment": ("time", numbers),
        },
        attrs={
            "recording": chosen.name,
            **columns(recording, f"recording_id sample_rate_hz started_utc {_ORIGIN}"),
            "segments_json": json.dumps(
                [{"label": each.label, **each.numbers} for each in recording.segments]
            ),
        },
    )


def _attributes(channel: ChannelHeader) -> dict[str, str | float]:
    known = {name: value for name, value in asdict(channel).items() if value not in {None, ""}}
    del known["role"], known["unit"]
    return {"units": channel.unit, "long_name": channel.role.replace("_", " "), **known}
