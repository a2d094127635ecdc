"""Lower and upper edges of a signal, for drawing.

If a column of the picture is shorter than a period, its extremes beat with the period, and a steady sine
would look like a comb. The extremes are then taken over a whole period around the column. If a period spans
many columns, the waveform is drawn. If a column contains a whole period, its own extremes are drawn.
"""

from collections.abc import Sequence
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
from ..recordings.channels import RESPONSE, OnRead, ignore_reading
from ..signals import Reals

# Envelopes: the smallest and largest sample in every column of the picture. Every sample belongs to a column,
# so an impact of three samples is visible at any zoom. Drawing every n-th sample would show it in only a few
# percent of the frames.

Samples = NDArray[np.float32] | NDArray[np.float64]


def envelope(samples: Samples, columns: int) -> tuple[Samples, Samples]:
    """Return the smallest and largest sample of each column of a picture.

    Raises InvalidRequest when no column is requested.

    Parameters
    ----------
    samples
        Signals, shape (..., samples). Lost samples are NaN; a column is NaN if all of its samples are lost.
    columns
        Number of columns. If there are no more samples than columns, the samples are returned.

    Returns
    -------
    Smallest and largest value of each column, shape (..., columns). Column c starts at sample
    ``c * n // columns``, as in `column_starts`.
    """
    if columns < 1:
        raise InvalidRequest(f"{columns} columns were requested; a picture needs 1 or more")
    count = samples.shape[-1]
    if count <= columns:
        return samples, samples
    starts = column_starts(count, columns)
    # fmin and fmax ignore NaN, and are as fast as minimum and maximum.
    return (
        np.asarray(np.fmin.reduceat(samples, starts, axis=-1)),
        np.asarray(np.fmax.reduceat(samples, starts, axis=-1)),
    )


def column_starts(samples: int, columns: int) -> NDArray[np.int64]:
    """Return the first sample of each column of `envelope`, shape (columns,).

    There are no more columns than samples.

    Parameters
    ----------
    samples
        Number of samples of the signal.
    columns
        Number of columns of the picture.
    """
    shown = min(samples, columns)
    return np.arange(shown, dtype=np.int64) * samples // max(shown, 1)


def zigzag(low: Reals, high: Reals) -> Reals:
    """Return both edges of an envelope as one line that alternates between low and high.

    The shape is (..., 2 columns).

    Parameters
    ----------
    low, high
        Edges, shape (..., columns).
    """
    return np.stack((low, high), axis=-1).reshape(*low.shape[:-1], -1)


LEGIBLE_COLUMNS = 6.0
"""Minimum length of a period that is drawn as a waveform [columns]."""
_MARGIN = 1.25
"""Number of periods over which a column takes extremes; above 1, because the period of a sweep changes."""
_CLEAR = 0.25
"""Hysteresis for counting zero crossings, relative to the typical peak-to-peak value."""
_BLOCKS, _LEAST_COLUMNS = 32, 24
"""Number of parts of the signal in which periods are counted, and minimum number of columns per part."""


def outline(samples: Samples, columns: int) -> tuple[Samples, Samples]:
    """Return the lower and upper edges of signals in each column; the columns are those of `envelope`.

    Parameters
    ----------
    samples
        Signals, shape (..., samples).
    columns
        Number of columns of the picture.

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
    """Return the number of columns over which each column takes its extremes; 1 means the column alone."""
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
    """Return the reach of each column: the longest period in its part and both adjacent parts [columns]."""
    is_short = (periods > 1.0 / _MARGIN) & (periods < LEGIBLE_COLUMNS)
    reach = np.where(is_short, np.ceil(_MARGIN * np.where(is_short, periods, 1.0)), 1.0).astype(np.int64)
    beside = np.pad(reach, 1, mode="edge")
    longest = np.max([beside[:-2], reach, beside[2:]], axis=0)
    return np.repeat(longest, np.diff(borders))


def period_of(samples: Samples, low: Samples, high: Samples) -> float:
    """Return the period in columns; infinite for a signal that does not oscillate.

    Noise around the mean is ignored.
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
    """Return, for every column, the extremes over ``reach`` columns around it."""
    lowest, highest = low.copy(), high.copy()
    for each in np.unique(reach[reach > 1]):
        here = reach == each
        lowest[here] = _spread_extremes(low, int(each), np.fmin)[here]
        highest[here] = _spread_extremes(high, int(each), np.fmax)[here]
    return lowest, highest


def _spread_extremes(edge: Samples, reach: int, extreme: np.ufunc) -> Samples:
    """Return, for every column, the extreme over ``reach`` columns around it."""
    before, found = (reach - 1) // 2, edge.copy()
    padded = np.pad(edge, (before, reach - 1 - before), mode="edge")
    for shift in range(reach):
        extreme(found, padded[shift : shift + edge.size], out=found)
    return found


# Pictures of bounded width, of any part of a recording. Long parts are drawn from the extremes stored in the
# file, short parts from the samples. No sample is skipped: even an impact of three samples is visible.
#
# A thumbnail shows a whole recording in about a hundred columns, for lists of recordings.

_COARSER = 16
"""Number of bins of one level that form one bin of the next level."""
_LEAST_BINS = 20_000
"""Number of bins up to which no coarser level is needed; reducing these bins to columns takes 0.1 ms."""
_STRETCHES, _LOOKED_AT, _MOST_LOOKED_AT = 8, 16, 65_536
"""For counting periods in a long recording: parts, columns per part, and maximum samples per part."""
_PIECE_SAMPLES = 20 * CHUNK_SAMPLES

Counts = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Picture:
    """Part of a recording or run for drawing: lower and upper edges of some channels."""

    time_s: Reals
    """Left edge of each column [s since the first sample], shape (columns,)."""
    low: Samples
    """Lower edges, shape (channels, columns), in the unit of each channel; NaN if all samples were lost."""
    high: Samples
    samples_per_column: float
    """Samples per column; 1 if the samples themselves are shown."""


@dataclass(frozen=True, eq=False)
class OverviewLevel:
    """Smallest and largest values in bins of equal length, in the unit of the channel, shape (bins,)."""

    bin_samples: int
    low: NDArray[np.float32]
    high: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class RecordingOverview:
    """A recording with the extremes of its bins; `overview_of` creates it."""

    recording: Recording
    levels: dict[str, tuple[OverviewLevel, ...]]
    """Extremes of the bins, keyed by role of the channel, from short to long bins."""

    def picture(self, roles: Sequence[str], start: int, stop: int, columns: int) -> Picture:
        """Return samples ``start`` to ``stop`` (exclusive) of some channels in about ``columns`` columns.

        Raises InvalidRequest when no sample, column or channel is requested.
        """
        begin, end = max(0, start), min(stop, self.recording.samples)
        if not (begin < end and columns >= 1 and roles):
            raise InvalidRequest(
                f"samples {start} to {stop} of {len(roles)} channels in {columns} columns were requested; "
                f"give at least one of each; {self.recording.path.name} has {self.recording.samples} samples"
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
        edges: list[tuple[Samples, Samples]] = []
        for role in roles:
            level = next(each for each in self.levels[role] if each.bin_samples == bin_samples)
            low, _ = envelope(level.low[first:last], columns)
            _, high = envelope(level.high[first:last], columns)
            reach = self._reach(role, first * bin_samples, last * bin_samples, low.size)
            edges.append(widen_extremes(low, high, reach))
        starts = first + column_starts(last - first, columns)
        time_s = starts.astype(np.float64) * (bin_samples / self.recording.sample_rate_hz)
        per_column = (last - first) * bin_samples / starts.size
        lows, highs = (np.asarray(each, dtype=np.float32) for each in zip(*edges, strict=True))
        return Picture(time_s, lows, highs, per_column)

    def _reach(self, role: str, begin: int, end: int, columns: int) -> NDArray[np.int64]:
        """Return the reach of each column, from the periods in some parts of the samples.

        Stored bins are too long to show periods of less than two columns.
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
    """Return whether the file contains an overview, so that little data is read for drawing."""
    return recording.read_overview(recording.roles[0]) is not None


def overview_of(recording: Recording, on_read: OnRead = ignore_reading) -> RecordingOverview:
    """Return the overview from the file; compute it from all samples if the file contains none.

    Growing, interrupted and older recordings contain no overview. Half a gigabyte of samples takes one to two
    seconds.
    """
    return RecordingOverview(recording, overview_levels(recording, on_read))


def overview_levels(
    recording: Recording, on_read: OnRead = ignore_reading
) -> dict[str, tuple[OverviewLevel, ...]]:
    """Return extremes per bin of every channel, from short to long bins; ``on_read`` receives progress."""
    levels: dict[str, tuple[OverviewLevel, ...]] = {}
    values = recording.samples * len(recording.channels)
    for number, channel in enumerate(recording.channels):
        kept = recording.read_overview(channel.role)
        if kept is None:
            kept = _build(recording, channel.role, number * recording.samples, values, on_read)
        levels[channel.role] = _levels(kept, channel)
    return levels


def kept_levels(recording: Recording, role: str) -> tuple[OverviewLevel, ...]:
    """Return the stored smallest and largest values of ``role`` per bin, from short to long bins.

    Raises InvalidRequest when the file contains no overview.
    """
    kept = recording.read_overview(role)
    if kept is None:
        raise InvalidRequest(f"{recording.path.name} has no overview of {role}; make it with overview_levels")
    return _levels(kept, recording.channel(role))


def _build(recording: Recording, role: str, before: int, values: int, on_read: OnRead) -> CountOverview:
    sums = OverviewSums()
    for first in range(0, recording.samples, _PIECE_SAMPLES):
        last = min(first + _PIECE_SAMPLES, recording.samples)
        sums.add(recording.read_counts(role, first, last))
        on_read(before + last, values)
    return sums.overview()


def _levels(kept: CountOverview, channel: ChannelHeader) -> tuple[OverviewLevel, ...]:
    low, high = _scale(kept.low, channel), _scale(kept.high, channel)
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


def _scale(counts: Counts, channel: ChannelHeader) -> NDArray[np.float32]:
    values = counts * np.float64(channel.scale_factor) + channel.add_offset
    values[counts == MISSING_COUNT] = np.nan
    return values.astype(np.float32)


THUMBNAIL_COLUMNS = 120
READ_WHOLE_SAMPLES = 50_000_000
"""Maximum number of values to read for the thumbnail of a file without an overview; about one second."""


@dataclass(frozen=True, eq=False)
class Thumbnail:
    """Lower and upper edge of the response over a whole recording, scaled to -1 to 1."""

    low: NDArray[np.float32]
    high: NDArray[np.float32]


def thumbnail(path: Path) -> Thumbnail | None:
    """Return a thumbnail; None if the recording is empty, unreadable or too slow to read."""
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
    edges = np.asarray([picture.low[0], picture.high[0]], dtype=np.float32)
    largest = float(np.max(np.abs(edges), where=np.isfinite(edges), initial=0.0))
    return Thumbnail(*(edges / largest)) if largest > 0 else None
