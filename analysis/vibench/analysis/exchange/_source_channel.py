"""One channel of somebody else's file.

A table held in memory as a source: what formats give that cannot be read in stretches.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from vibench.acquisition.recording import Origin

from ..signals import Reals


@dataclass(frozen=True)
class SourceChannel:
    """What the file says of it."""

    name: str
    """How a mapping names it; no other channel of the file has it."""
    samples: int
    label: str = ""
    """What its maker called it; others may be called the same."""
    sample_rate_hz: float | None = None
    """None when the file does not say."""
    unit: str = ""
    step: float | None = None
    """Distance of neighbouring values when they come from integers, so that they are kept exactly."""
    origin: Origin | None = None
    """Whether it was measured or simulated; None when the file does not say."""
    full_scale: float | None = None
    """Largest value the file can hold, where that is the converter's range."""


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
