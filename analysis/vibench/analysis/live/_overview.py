"""Any stretch of a recording as a picture of bounded width, however long the recording is.

Wide stretches are drawn from the extremes of bins that the file keeps, narrow ones from the samples
themselves; nothing in between is skipped, so an impact of three samples is in every picture.

A whole recording in a hundred columns: what a list of recordings shows beside a name.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vibench.acquisition import RecordingError, open_recording
from vibench.acquisition.recording import (
    BIN_SAMPLES,
    CHUNK_SAMPLES,
    MISSING_COUNT,
    ChannelHeader,
    CountOverview,
    OverviewSums,
    Recording,
)

from ..errors import InvalidRequest
from ..recordings.channels import RESPONSE
from ..signals.arrays import Reals
from ._outline import Samples, column_starts, envelope, outline, period_of, reach_of, widened

_COARSER = 16
"""Bins of one level in one bin of the next."""
_LEAST_BINS = 20_000
"""A level with fewer bins than this needs no coarser one: reducing it takes a tenth of a millisecond."""
_STRETCHES, _LOOKED_AT, _MOST_LOOKED_AT = 8, 16, 65_536
"""Where periods are counted in a long recording: so many places, each of so many columns, no more samples."""
_PIECE_SAMPLES = 20 * CHUNK_SAMPLES

Counts = NDArray[np.int32]
OnRead = Callable[[int, int], None]
"""Told (values read, values in all), when an overview has to be made."""


def ignore_reading(done: int, asked: int) -> None:
    """Watch nothing."""


@dataclass(frozen=True, eq=False)
class Picture:
    """A stretch of some channels, as it is drawn."""

    time_s: Reals
    """Left edge of each column, since the first sample, shape (columns,)."""
    low: Samples
    """Shape (channels, columns), in the channels' units; NaN where all samples were lost."""
    high: Samples
    samples_per_column: float
    """1 where the samples themselves are shown."""


@dataclass(frozen=True, eq=False)
class OverviewLevel:
    """Extremes of bins of one length, in a channel's unit; arrays of shape (bins,)."""

    bin_samples: int
    low: NDArray[np.float32]
    high: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class RecordingOverview:
    """A recording that can be looked at; made by `overview_of`."""

    recording: Recording
    levels: dict[str, tuple[OverviewLevel, ...]]
    """By role; fine to coarse."""

    def picture(self, roles: Sequence[str], start: int, stop: int, columns: int) -> Picture:
        """Draw samples ``start`` to ``stop`` (exclusive) of some channels, about so many columns wide.

        Raises
        ------
        InvalidRequest
            For a stretch or a width of nothing.

        """
        begin, end = max(0, start), min(stop, self.recording.samples)
        if not (begin < end and columns >= 1 and roles):
            raise InvalidRequest(
                f"samples {start} to {stop} of {len(roles)} channels in {columns} columns were asked for; "
                f"{self.recording.path.name} has samples 0 to {self.recording.samples}"
            )
        wanted = (end - begin) / columns
        if wanted < BIN_SAMPLES:
            return self._from_samples(roles, begin, end, columns)
        fitting = [each for each in self.levels[roles[0]] if each.bin_samples <= wanted]
        return self._from_bins(roles, begin, end, columns, fitting[-1].bin_samples)

    def _from_samples(self, roles: Sequence[str], begin: int, end: int, columns: int) -> Picture:
        values = np.stack([self.recording.read(role, begin, end) for role in roles])
        low, high = outline(values, columns)
        starts = column_starts(end - begin, columns)
        time_s = (begin + starts) / self.recording.sample_rate_hz
        return Picture(time_s, low, high, (end - begin) / starts.size)

    def _from_bins(
        self, roles: Sequence[str], begin: int, end: int, columns: int, bin_samples: int
    ) -> Picture:
        first, last = begin // bin_samples, -(-end // bin_samples)
        lows: list[Samples] = []
        highs: list[Samples] = []
        for role in roles:
            level = next(each for each in self.levels[role] if each.bin_samples == bin_samples)
            low, high = (
                envelope(level.low[first:last], columns)[0],
                envelope(level.high[first:last], columns)[1],
            )
            reach = self._reach(role, first * bin_samples, last * bin_samples, low.size)
            for edges, edge in zip((lows, highs), widened(low, high, reach), strict=True):
                edges.append(edge)
        starts = first + column_starts(last - first, columns)
        time_s = starts.astype(np.float64) * (bin_samples / self.recording.sample_rate_hz)
        per_column = (last - first) * bin_samples / starts.size
        low, high = np.asarray(lows, dtype=np.float32), np.asarray(highs, dtype=np.float32)
        return Picture(time_s, low, high, per_column)

    def _reach(self, role: str, begin: int, end: int, columns: int) -> NDArray[np.int64]:
        """Count the columns that hold a period, from a piece of each of some stretches.

        The file keeps no bin shorter than a column, and samples alone tell a period of less than two columns.
        """
        borders = np.linspace(0, columns, _STRETCHES + 1).astype(np.int64)
        wide = (end - begin) / columns
        size = round(_LOOKED_AT * wide)
        periods = np.full(_STRETCHES, np.inf)
        if size <= _MOST_LOOKED_AT:
            for number, place in enumerate((borders[:-1] + borders[1:]) / 2):
                first = begin + round(place * wide)
                piece = self.recording.read(role, first, min(first + size, self.recording.samples))
                if piece.size:
                    periods[number] = period_of(piece, *envelope(piece, max(1, round(piece.size / wide))))
        return reach_of(periods, borders)


def has_overview(recording: Recording) -> bool:
    """Whether the file keeps its overview, so that looking at it reads next to nothing."""
    return recording.read_overview(recording.roles[0]) is not None


def overview_of(recording: Recording, on_read: OnRead = ignore_reading) -> RecordingOverview:
    """Take the overview from the file, or make it of all samples when the file has none.

    A growing or interrupted recording, and one from an older version, has none: half a gigabyte of
    samples then takes one or two seconds.
    """
    return RecordingOverview(recording, overview_levels(recording, on_read))


def overview_levels(
    recording: Recording, on_read: OnRead = ignore_reading
) -> dict[str, tuple[OverviewLevel, ...]]:
    """Give the extremes of every channel, fine to coarse: what crosses from a process that made them.

    Parameters
    ----------
    recording
        Open.
    on_read
        Told how many samples were read, and of how many.

    """
    levels: dict[str, tuple[OverviewLevel, ...]] = {}
    values = recording.samples * len(recording.channels)
    for number, channel in enumerate(recording.channels):
        kept = recording.read_overview(channel.role)
        if kept is None:
            kept = _made(recording, channel.role, number * recording.samples, values, on_read)
        levels[channel.role] = _levels(kept, channel)
    return levels


def kept_levels(recording: Recording, role: str) -> tuple[OverviewLevel, ...]:
    """Give the extremes of one channel, fine to coarse, as the file keeps them; see `has_overview`.

    Parameters
    ----------
    recording
        Open.
    role
        Name of the channel.

    Raises
    ------
    InvalidRequest
        When the file keeps none.

    """
    kept = recording.read_overview(role)
    if kept is None:
        raise InvalidRequest(
            f"{recording.path.name} keeps no overview of {role}; make it with overview_levels"
        )
    return _levels(kept, recording.channel(role))


def _made(recording: Recording, role: str, before: int, values: int, on_read: OnRead) -> CountOverview:
    sums = OverviewSums()
    for first in range(0, recording.samples, _PIECE_SAMPLES):
        last = min(first + _PIECE_SAMPLES, recording.samples)
        sums.add(recording.read_counts(role, first, last))
        on_read(before + last, values)
    return sums.overview()


def _levels(kept: CountOverview, channel: ChannelHeader) -> tuple[OverviewLevel, ...]:
    low, high = _scaled(kept.low, channel), _scaled(kept.high, channel)
    if channel.scale_factor < 0:
        low, high = high, low
    levels = [OverviewLevel(BIN_SAMPLES, low, high)]
    while levels[-1].low.size > _LEAST_BINS:
        fine = levels[-1]
        starts = np.arange(0, fine.low.size, _COARSER)
        levels.append(
            OverviewLevel(
                fine.bin_samples * _COARSER,
                np.fmin.reduceat(fine.low, starts),
                np.fmax.reduceat(fine.high, starts),
            )
        )
    return tuple(levels)


def _scaled(counts: Counts, channel: ChannelHeader) -> NDArray[np.float32]:
    values = counts * np.float64(channel.scale_factor) + channel.add_offset
    values[counts == MISSING_COUNT] = np.nan
    return values.astype(np.float32)


THUMBNAIL_COLUMNS = 120
READ_WHOLE_SAMPLES = 50_000_000
"""Values that are read for the thumbnail of a file without an overview: about a second."""


@dataclass(frozen=True, eq=False)
class Thumbnail:
    """The response of a whole recording, in few columns; each between -1 and 1."""

    low: NDArray[np.float32]
    high: NDArray[np.float32]


def thumbnail(path: Path) -> Thumbnail | None:
    """Draw a recording small; None where there is nothing to draw, or it would take too long."""
    try:
        with open_recording(path) as recording:
            if recording.samples == 0 or not _is_quickly_seen(recording):
                return None
            role = RESPONSE if RESPONSE in recording.roles else recording.roles[-1]
            picture = overview_of(recording).picture((role,), 0, recording.samples, THUMBNAIL_COLUMNS)
    except RecordingError:
        return None
    known = np.isfinite(picture.low[0]) & np.isfinite(picture.high[0])
    if not known.any():
        return None
    low, high = (np.asarray(each[0], dtype=np.float32) for each in (picture.low, picture.high))
    largest = max(float(np.max(np.abs(low[known]))), float(np.max(np.abs(high[known]))))
    if largest <= 0:
        return None
    return Thumbnail(*(np.asarray(each / largest, dtype=np.float32) for each in (low, high)))


def _is_quickly_seen(recording: Recording) -> bool:
    return has_overview(recording) or recording.samples * len(recording.roles) <= READ_WHOLE_SAMPLES
