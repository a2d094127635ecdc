"""One channel of a foreign file, and a table in memory as a source."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf

from vibench.acquisition.recording import Origin

from ..signals.arrays import Reals

LEAST_INTERVAL_S = 1e-100
"""Shortest interval between samples, whose inverse is finite."""
SECONDS = {
    **dict.fromkeys(("", "none", "s", "sec", "secs", "sek", "second", "seconds", "sekunden"), 1.0),
    **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds"), 1e-3),
    **dict.fromkeys(("us", "\u03bcs", "usec", "microsecond", "microseconds"), 1e-6),
    **dict.fromkeys(("ns", "nanosecond", "nanoseconds"), 1e-9),
    **dict.fromkeys(("min", "minute", "minutes", "minuten"), 60.0),
    **dict.fromkeys(("h", "hour", "hours", "stunden"), 3600.0),
    **dict.fromkeys(("d", "day", "days", "tage"), 86400.0),
}
"""Length in seconds of a unit of time, by its text without regard to case."""


def rate_bounds(interval: float, uncertainty: float, unit: str) -> tuple[float, float] | None:
    """Turn an interval between samples, in a unit of time, into bounds of the rate [Hz]; None if none."""
    second = SECONDS.get(unit.casefold(), 0.0)
    shortest, longest = second * (interval - uncertainty), second * (interval + uncertainty)
    return (1 / longest, 1 / shortest) if LEAST_INTERVAL_S < shortest <= longest < inf else None


def text_of(raw: bytes) -> str:
    """Decode text in one of two encodings, which files do not state."""
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


@dataclass(frozen=True)
class SourceChannel:
    """A channel as described by its file."""

    name: str
    """Unique name in the file, for mappings."""
    samples: int
    label: str = ""
    """Label in the file; not unique."""
    sample_rate_hz: float | None = None
    """Sample rate; None if the file does not state it exactly."""
    unit: str = ""
    step: float | None = None
    """Step between values from integers, to store them exactly."""
    origin: Origin | None = None
    """Whether it was measured or simulated; None if unknown."""
    full_scale: float | None = None
    """Largest value in the file format, if that is the converter's range."""
    rate_bounds_hz: tuple[float, float] | None = None
    """Bounds of the sample rate, from times with few digits."""
    start_s: float | None = None
    """Time of its first sample, on the common clock of the file."""
    start_error_s: float = 0.0
    runs: tuple[tuple[int, int], ...] = ()
    """First sample and its place in sample intervals, for each stretch; empty if all are even."""
    time_unit: str | None = None
    """Unit of its times, empty if not stated; None without times."""
    time_trouble: str = ""
    """Contradiction in the file's time information; empty if there is none."""

    @property
    def rates_hz(self) -> tuple[float, float]:
        """Bounds of the sample rate."""
        exact = self.sample_rate_hz
        return (self.rate_bounds_hz or (0.0, inf)) if exact is None else (exact, exact)


@dataclass(frozen=True, eq=False)
class TableSource:
    """A table of channels in memory."""

    numbers: Mapping[SourceChannel, Reals]

    @property
    def channels(self) -> tuple[SourceChannel, ...]:
        """In the order of the file."""
        return tuple(self.numbers)

    def read(self, channel: SourceChannel, start: int, stop: int) -> Reals:
        """Return a stretch."""
        return self.numbers[channel][start:stop]
