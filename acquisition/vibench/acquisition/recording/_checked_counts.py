"""Counts that are as they were when the seal was checked: each piece is hashed again as it is read.

A check reads a recording from end to end, and an analysis reads it again. So that what is read is what was
checked, the state of each channel's checksum before every piece is kept, by the seal, for as long as this
process lives: whatever file carries that seal is held against it.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import h5py
import numpy as np

from ._counts import Counts
from ._seal import PIECE_ITEMS, ChannelStates

if TYPE_CHECKING:
    from hashlib import _Hash as Hash

_KNOWN: dict[str, ChannelStates] = {}
"""By seal. About 20 kB for a recording of a minute."""


def remember(seal: str, states: ChannelStates) -> None:
    """Hold what carries this seal against these states from now on."""
    _KNOWN[seal] = states


def forget_checks() -> None:
    """Hold nothing against what was read before: all is looked at anew."""
    _KNOWN.clear()


def was_checked(seal: str) -> bool:
    """Whether a file with this seal was found intact as a whole by this process."""
    return seal in _KNOWN


class CheckedCounts:
    """Reads the channels of one open file, and keeps the last piece of each."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[int, Counts]] = {}

    def read(self, seal: str, dataset: h5py.Dataset, begin: int, end: int) -> Counts:
        """Give a range of a channel; raises ValueError where it is not what was checked."""
        known = _KNOWN.get(seal)
        if known is None:
            return np.asarray(dataset[begin:end], dtype=np.int32)
        counts = np.empty(end - begin, dtype=np.int32)
        for number in range(begin // PIECE_ITEMS, -(-end // PIECE_ITEMS)):
            first = number * PIECE_ITEMS
            piece = self._piece(known[dataset.name], dataset, number)
            low, high = max(begin, first), min(end, first + len(piece))
            counts[low - begin : high - begin] = piece[low - first : high - first]
        return counts

    def _piece(self, states: "Sequence[Hash]", dataset: h5py.Dataset, number: int) -> Counts:
        held, counts = self._last.get(dataset.name, (-1, None))
        if held == number and counts is not None:
            return counts
        first = number * PIECE_ITEMS
        piece = np.ascontiguousarray(dataset[first : first + PIECE_ITEMS], dtype=np.int32)
        digest = states[number].copy()
        digest.update(piece.data)
        if digest.digest() != states[number + 1].digest():
            raise ValueError("they are no longer what they were when the seal was checked")
        self._last[dataset.name] = (number, piece)
        return piece
