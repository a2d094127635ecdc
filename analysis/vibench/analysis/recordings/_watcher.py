"""Who is told how far an analysis is: a progress bar, or nobody."""

from dataclasses import dataclass
from typing import Protocol

from ..signals import Flags, Reals
from ._channels import Channels, Stretch


class Watcher(Protocol):
    """Told what is computed and how much of the recording was read."""

    def begin(self, recording: str, stage: str) -> None:
        """Hear that a stage of one recording begins, ``"averaging spectra"`` for example."""

    def read(self, samples: int, of: int) -> None:
        """Hear how many samples per channel of the stage are read."""


class Unwatched:
    """Tells nobody."""

    def begin(self, recording: str, stage: str) -> None:
        """Ignore it."""

    def read(self, samples: int, of: int) -> None:
        """Ignore it."""


@dataclass(frozen=True, eq=False)
class WatchedChannels:
    """Channels whose reading is watched."""

    channels: Channels
    watcher: Watcher

    @property
    def sample_rate_hz(self) -> float:
        """Of all channels."""
        return self.channels.sample_rate_hz

    @property
    def samples(self) -> int:
        """Valid samples per channel."""
        return self.channels.samples

    @property
    def response_delay_s(self) -> float:
        """By how much the response channel lags the base channel."""
        return self.channels.response_delay_s

    def stretches(self, label: str) -> tuple[Stretch, ...]:
        """Give the named parts of the record."""
        return self.channels.stretches(label)

    def read(self, start: int, stop: int) -> Reals:
        """Give drive, base and response, shape (3, samples), and say how far the record is read."""
        data = self.channels.read(start, stop)
        self.watcher.read(stop, self.samples)
        return data

    def overloaded(self, start: int, stop: int) -> Flags:
        """Say at which samples one of the channels was near its full scale."""
        return self.channels.overloaded(start, stop)
