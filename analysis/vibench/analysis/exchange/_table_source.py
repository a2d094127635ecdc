"""A table held in memory as a source: what formats give that cannot be read in stretches."""

from collections.abc import Mapping
from dataclasses import dataclass

from ..signals import Reals
from ._source_channel import SourceChannel


@dataclass(frozen=True, eq=False)
class TableSource:
    """Channels with all their numbers."""

    numbers: Mapping[SourceChannel, Reals]

    @property
    def channels(self) -> tuple[SourceChannel, ...]:
        """In the order of the file."""
        return tuple(self.numbers)

    def read(self, channel: SourceChannel, start: int, stop: int) -> Reals:
        """Give a stretch."""
        return self.numbers[channel][start:stop]
