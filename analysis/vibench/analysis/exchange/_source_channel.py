"""One channel of somebody else's file.

A table held in memory as a source: what formats give that cannot be read in stretches.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf

from vibench.acquisition.recording import Origin

from ..signals.arrays import Reals

LEAST_INTERVAL_S = 1e-100
"""Shorter is no time between samples, and its inverse may be no number."""
SECONDS = {
    **dict.fromkeys(("", "none", "s", "sec", "secs", "sek", "second", "seconds", "sekunden"), 1.0),
    **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds"), 1e-3),
    **dict.fromkeys(("us", "\u03bcs", "usec", "microsecond", "microseconds"), 1e-6),
    **dict.fromkeys(("ns", "nanosecond", "nanoseconds"), 1e-9),
    **dict.fromkeys(("min", "minute", "minutes", "minuten"), 60.0),
    **dict.fromkeys(("h", "hour", "hours", "stunden"), 3600.0),
}
"""Length in seconds of a unit of time, by its text without regard to case."""


def rate_bounds(interval: float, uncertainty: float, unit: str) -> tuple[float, float] | None:
    """Turn an interval between samples, in a unit of time, into bounds of the rate [Hz]; None if none."""
    second = SECONDS.get(unit.casefold(), 0.0)
    shortest, longest = second * (interval - uncertainty), second * (interval + uncertainty)
    return (1 / longest, 1 / shortest) if LEAST_INTERVAL_S < shortest <= longest < inf else None


def text_of(raw: bytes) -> str:
    """Decode text; makers write ``m/s²`` in one of two encodings, and say in neither which."""
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


@dataclass(frozen=True)
class SourceChannel:
    """What the file says of it."""

    name: str
    """How a mapping names it; no other channel of the file has it."""
    samples: int
    label: str = ""
    """What its maker called it; others may be called the same."""
    sample_rate_hz: float | None = None
    """None when the file does not say, or not exactly."""
    unit: str = ""
    step: float | None = None
    """Distance of neighbouring values when they come from integers, so that they are kept exactly."""
    origin: Origin | None = None
    """Whether it was measured or simulated; None when the file does not say."""
    full_scale: float | None = None
    """Largest value the file can hold, where that is the converter's range."""
    rate_bounds_hz: tuple[float, float] | None = None
    """The same where the file does not say it exactly, but tells times in few digits."""
    start_s: float | None = None
    """When its first sample was taken, on the clock that all channels of the file share."""
    start_error_s: float = 0.0
    runs: tuple[tuple[int, int], ...] = ()
    """First sample, and its place in sample intervals, of each stretch; empty where all are even."""
    time_unit: str | None = None
    """Unit of its times, empty where the file states none; None where it has no times."""
    time_trouble: str = ""
    """Contradiction in the file's time information; empty if there is none."""

    @property
    def rates_hz(self) -> tuple[float, float]:
        """Between which the rate lies, as far as the file tells it."""
        exact = self.sample_rate_hz
        return (self.rate_bounds_hz or (0.0, inf)) if exact is None else (exact, exact)


@dataclass(frozen=True, eq=False)
class TableSource:
    """Channels with all their numbers."""

    numbers: Mapping[SourceChannel, Reals]

    @property
    def channels(self) -> tuple[SourceChannel, ...]:
        """In the order of the file."""
        return tuple(self.numbers)

    def read(self, channel: SourceChannel, start: int, stop: int) -> Reals:
        """Return a stretch."""
        return self.numbers[channel][start:stop]
