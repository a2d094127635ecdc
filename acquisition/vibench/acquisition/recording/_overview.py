"""Overview: the smallest and largest count of every 128 samples, for plots of whole recordings.

The overview is computed when a recording is finished, and stored in the group ``overview``. A viewer then
opens long recordings as fast as short recordings. Without an overview, the viewer reads the whole file once.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import h5py
import numpy as np

from ..instruments import Counts
from . import _layout as layout
from ._layout import packing, read_attributes, write_attributes

BIN_SAMPLES = 128
"""Samples per bin. For finer detail, a plot of 1000 columns reads at most 128 000 samples (10 ms)."""
LOW_SUFFIX, HIGH_SUFFIX = "_low", "_high"
_LARGEST = np.int32(layout.LARGEST_COUNT)


@dataclass(frozen=True, eq=False)
class CountOverview:
    """Smallest and largest count of each bin; both are the missing count if all samples of a bin are lost."""

    low: Counts
    high: Counts


def extremes(counts: Counts) -> CountOverview:
    """Return the extremes of each bin of consecutive counts; the first bin starts at the first count."""
    if counts.size == 0:
        return CountOverview(counts, counts)
    starts = np.arange(0, counts.size, BIN_SAMPLES)
    high = np.maximum.reduceat(counts, starts)
    low = np.minimum.reduceat(counts, starts)
    holed = np.flatnonzero(low == layout.MISSING_COUNT)
    if holed.size:
        known = np.where(counts == layout.MISSING_COUNT, _LARGEST, counts)
        found = np.minimum.reduceat(known, starts)
        low[holed] = np.where(high[holed] == layout.MISSING_COUNT, layout.MISSING_COUNT, found[holed])
    return CountOverview(low, high)


class OverviewSums:
    """Overview of a channel whose counts arrive in pieces; only the last piece may end within a bin."""

    def __init__(self) -> None:
        self._low: list[Counts] = []
        self._high: list[Counts] = []

    def add_pieces(self, pieces: Iterator[Counts]) -> Iterator[Counts]:
        """Yield the pieces unchanged, and add each to the overview."""
        for piece in pieces:
            self.add(piece)
            yield piece

    def add(self, piece: Counts) -> None:
        """Add the next counts of the channel."""
        found = extremes(piece)
        self._low.append(found.low)
        self._high.append(found.high)

    def overview(self) -> CountOverview:
        """Return the overview of all counts added so far."""
        nothing = [np.empty(0, dtype=layout.COUNT_DTYPE)]
        return CountOverview(np.concatenate(self._low or nothing), np.concatenate(self._high or nothing))


def write_overview(file: h5py.File, role: str, overview: CountOverview, sample_rate_hz: float) -> None:
    """Write a channel's overview with the scale factors of its samples, for readers of netCDF."""
    group = file.require_group(layout.OVERVIEW)
    bins = overview.low.size
    if layout.BIN not in group:
        axis = group.create_dataset(
            layout.BIN, data=np.arange(bins, dtype=layout.COUNT_DTYPE), **packing(bins)
        )
        bin_s = BIN_SAMPLES / sample_rate_hz
        write_attributes(
            axis,
            {"units": "s", "scale_factor": bin_s, "add_offset": 0.0, "long_name": "start time of the bin"},
        )
        axis.make_scale(layout.BIN)
        write_attributes(group, {"samples_per_bin": BIN_SAMPLES})
    for suffix, counts in ((LOW_SUFFIX, overview.low), (HIGH_SUFFIX, overview.high)):
        dataset = group.create_dataset(role + suffix, data=counts.astype(layout.COUNT_DTYPE), **packing(bins))
        for name in ("scale_factor", "add_offset", "units"):
            dataset.attrs[name] = file[role].attrs[name]
        dataset.attrs["_FillValue"] = np.int32(layout.MISSING_COUNT)
        dataset.dims[0].attach_scale(group[layout.BIN])


def read_overview(file: h5py.File, role: str, samples: int) -> CountOverview | None:
    """Read a channel's overview; None if the overview is missing or has a wrong shape."""
    group = file.get(layout.OVERVIEW)
    if not isinstance(group, h5py.Group) or read_attributes(group).get("samples_per_bin") != BIN_SAMPLES:
        return None
    extremes = [group.get(role + suffix) for suffix in (LOW_SUFFIX, HIGH_SUFFIX)]
    # Number of bins; the last may be partly filled.
    if any(
        not isinstance(each, h5py.Dataset)
        or each.shape != (-(-samples // BIN_SAMPLES),)
        or each.dtype != np.dtype(layout.COUNT_DTYPE)
        for each in extremes
    ):
        return None
    try:
        low, high = (each[:] for each in extremes)
    except OSError:
        return None
    return CountOverview(low, high)
