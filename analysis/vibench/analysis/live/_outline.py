"""The edges of a signal as they are drawn, where its periods are too many to be told apart.

A column of the picture that is shorter than a period holds a part of it: one column has the crest,
the next has not, and the edges of a steady sine look like a comb that beats with the columns. There
each column is given the extremes of a whole period around it, and a steady sine has straight edges.
Where a period is many columns long its waveform is drawn, and where a column holds a whole one its
extremes are: both are left alone, and nowhere is an extreme lost.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf
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

# What of a signal is drawn: the smallest and largest sample of every column of the picture.
#
# Every sample is in exactly one column, so an impact of three samples is seen at any zoom; every n-th
# sample would show it in a few percent of the frames.

Samples = NDArray[np.float32] | NDArray[np.float64]


def envelope(samples: Samples, columns: int) -> tuple[Samples, Samples]:
    """Reduce signals to their extremes, column by column.

    Parameters
    ----------
    samples
        Shape (..., samples). Lost samples are NaN; a column is NaN where all of its samples are lost.
    columns
        Of the picture. Fewer samples than columns are given back as they are.

    Returns
    -------
    Smallest and largest value of each column, shape (..., columns). Column c holds the samples from
    ``c * n // columns`` on, which `column_starts` names.

    Raises
    ------
    InvalidRequest
        When there is no column.
    """
    if columns < 1:
        raise InvalidRequest(f"{columns} columns were asked for; a picture has 1 or more")
    count = samples.shape[-1]
    if count <= columns:
        return samples, samples
    starts = column_starts(count, columns)
    # fmin and fmax pass over NaN, and cost the same as minimum and maximum.
    return (
        np.asarray(np.fmin.reduceat(samples, starts, axis=-1)),
        np.asarray(np.fmax.reduceat(samples, starts, axis=-1)),
    )


def column_starts(samples: int, columns: int) -> NDArray[np.int64]:
    """First sample of each column of `envelope`.

    Parameters
    ----------
    samples
        How many a signal has.
    columns
        How many the picture has.

    Returns
    -------
    ndarray
        Shape (columns,).
    """
    shown = min(samples, columns)
    return np.arange(shown, dtype=np.int64) * samples // max(shown, 1)


def zigzag(low: Reals, high: Reals) -> Reals:
    """Lay both edges of an envelope into one line, low and high in turn, shape (..., 2 columns).

    Parameters
    ----------
    low, high
        Edges, shape (..., columns).

    Returns
    -------
    ndarray
        Shape (..., 2 columns).
    """
    return np.stack((low, high), axis=-1).reshape(*low.shape[:-1], -1)


LEGIBLE_COLUMNS = 6.0
"""A period of this many columns is seen as a wave."""
_MARGIN = 1.25
"""Periods around a column: those of a sweep are not all alike."""
_CLEAR = 0.25
"""Share of the usual height that a sample must be away from the middle to tell its side."""
_BLOCKS, _LEAST_COLUMNS = 32, 24
"""Periods are counted in this many stretches, each of this many columns or more."""


def outline(samples: Samples, columns: int) -> tuple[Samples, Samples]:
    """Reduce signals to their edges, column by column; shapes and columns are those of `envelope`.

    Parameters
    ----------
    samples
        Shape (..., samples).
    columns
        Of the picture.

    Returns
    -------
    tuple of ndarray
        Lower and upper edge, shape (..., columns).
    """
    low, high = envelope(samples, columns)
    if samples.shape[-1] <= columns:
        return low, high
    lowest, highest = low.copy(), high.copy()
    for row in np.ndindex(samples.shape[:-1]):
        reach = columns_around(samples[row], (low[row], high[row]))
        lowest[row], highest[row] = widen_extremes(low[row], high[row], reach)
    return lowest, highest


def columns_around(samples: Samples, edges: tuple[Samples, Samples]) -> NDArray[np.int64]:
    """Count the columns that hold a period, around each column; 1 where the edges are to be left alone.

    The period is that of the stretch around the column: a sweep has many.
    """
    low, high = edges
    count = low.size
    blocks = max(1, min(_BLOCKS, count // _LEAST_COLUMNS))
    borders = np.arange(blocks + 1) * count // blocks
    places = borders * samples.size // count
    periods = [
        period_of(samples[places[each] : places[each + 1]], low[start:stop], high[start:stop])
        for each, (start, stop) in enumerate(pairwise(borders))
    ]
    return reach_of(np.array(periods), borders)


def reach_of(periods: Reals, borders: NDArray[np.int64]) -> NDArray[np.int64]:
    """Spread periods of stretches [columns] over their columns; next to a longer one it is that."""
    is_short = (periods > 1.0 / _MARGIN) & (periods < LEGIBLE_COLUMNS)
    reach = np.where(is_short, np.ceil(_MARGIN * np.where(is_short, periods, 1.0)), 1.0).astype(np.int64)
    beside = np.pad(reach, 1, mode="edge")
    longest = np.max([beside[:-2], reach, beside[2:]], axis=0)
    return np.repeat(longest, np.diff(borders))


def period_of(samples: Samples, low: Samples, high: Samples) -> float:
    """Measure a period in columns; infinite where the signal never goes up and down.

    Noise around the middle does not count.
    """
    known = np.isfinite(low)
    if not known.any():
        return inf
    middle, height = np.median(0.5 * (low + high)[known]), np.median((high - low)[known])
    moved = samples - middle
    sides = np.signbit(moved[np.abs(moved) > _CLEAR * height])
    turns = np.count_nonzero(sides[1:] != sides[:-1]) / 2
    return low.size / turns if turns else inf


def widen_extremes(low: Samples, high: Samples, reach: NDArray[np.int64]) -> tuple[Samples, Samples]:
    """Return every column the extremes of this many columns around it."""
    lowest, highest = low.copy(), high.copy()
    for each in np.unique(reach[reach > 1]):
        here = reach == each
        lowest[here] = _widened(low, int(each), np.fmin)[here]
        highest[here] = _widened(high, int(each), np.fmax)[here]
    return lowest, highest


def _widened(edge: Samples, reach: int, extreme: np.ufunc) -> Samples:
    """Return every column the extreme of this many columns around it."""
    before, found = (reach - 1) // 2, edge.copy()
    padded = np.pad(edge, (before, reach - 1 - before), mode="edge")
    for shift in range(reach):
        extreme(found, padded[shift : shift + edge.size], out=found)
    return found


# Any stretch of a recording as a picture of bounded width, however long the recording is.
#
# Wide stretches are drawn from the extremes of bins that the file keeps, narrow ones from the samples
# themselves; nothing in between is skipped, so an impact of three samples is in every picture.
#
# A whole recording in a hundred columns: what a list of recordings shows beside a name.

_COARSER = 16
"""Bins of one level in one bin of the next."""
_LEAST_BINS = 20_000
"""A level with fewer bins than this needs no coarser one: reducing it takes a tenth of a millisecond."""
_STRETCHES, _LOOKED_AT, _MOST_LOOKED_AT = 8, 16, 65_536
"""Where periods are counted in a long recording: number of places, columns of each, most samples."""
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
    """Levels by role, fine to coarse."""

    def picture(self, roles: Sequence[str], start: int, stop: int, columns: int) -> Picture:
        """Draw samples ``start`` to ``stop`` (exclusive) of some channels, about this many columns wide.

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
            values = np.stack([self.recording.read(role, begin, end) for role in roles])
            low, high = outline(values, columns)
            starts = column_starts(end - begin, columns)
            time_s = (begin + starts) / self.recording.sample_rate_hz
            return Picture(time_s, low, high, (end - begin) / starts.size)
        fitting = [each for each in self.levels[roles[0]] if each.bin_samples <= wanted]
        return self._from_bins(roles, begin, end, columns, fitting[-1].bin_samples)

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
            for edges, edge in zip((lows, highs), widen_extremes(low, high, reach), strict=True):
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
    """Return the extremes of every channel, fine to coarse: what crosses from a process that made them.

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
    """Return the extremes of one channel, fine to coarse, as the file keeps them; see `has_overview`.

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
            if recording.samples == 0 or not (
                has_overview(recording) or recording.samples * len(recording.roles) <= READ_WHOLE_SAMPLES
            ):
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
