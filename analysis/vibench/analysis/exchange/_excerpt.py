"""Part of a recording to export, and its metadata in a separate file if the format cannot store them."""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from math import isfinite
from pathlib import Path
from typing import Any

from vibench.acquisition.recording import ChannelHeader, RecordedBlock, Recording

from ..errors import InvalidRequest, NotEnoughData
from ..signals.arrays import Reals

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
            f"{recording.path.name} has 0 to {recording.duration_s:.9g} s; give a start and a later end"
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


def facts_document(excerpt: Excerpt) -> dict[str, Any]:
    """Return the facts of an excerpt; sample numbers count from the first sample of the recording."""
    recording = excerpt.recording
    return {
        "recording": excerpt.name,
        "recording_id": recording.recording_id,
        "started_utc": recording.started_utc,
        "origin": recording.origin.value,
        "state": recording.state.value,
        "reason": recording.reason,
        "sample_rate_hz": recording.sample_rate_hz,
        "first_sample": excerpt.start,
        "last_sample": excerpt.stop - 1,
        "channels": [
            {
                **asdict(each),
                "scale_factor": each.scale_factor,
                "add_offset": each.add_offset,
                "full_scale": abs(each.physical_per_volt) * each.range_v,
            }
            for each in excerpt.channels
        ],
        "segments": [asdict(each) for each in recording.segments],
        "events": [asdict(each) for each in recording.events],
        "overloads": [asdict(each) for each in recording.overloads],
        "gaps": [asdict(each) for each in recording.gaps],
        "plan": recording.plan,
        "bench": recording.bench,
        "instruments": {name: asdict(each) for name, each in recording.instruments.items()},
        "confirmations": recording.confirmations,
        "provenance": recording.provenance,
        "bench_check": recording.bench_check,
    }


def write_facts(excerpt: Excerpt, path: Path) -> None:
    """Write the facts of an excerpt as JSON."""
    text = json.dumps(facts_document(excerpt), indent=2, allow_nan=False, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")
