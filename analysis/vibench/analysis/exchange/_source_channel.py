"""The channels of a foreign file, and functions that read their samples."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vibench.acquisition import shorten
from vibench.acquisition.recording import Origin

from ..signals import Reals
from ._excerpt import BLOCK_SAMPLES

EXACT_KINDS = {"i": 4, "u": 2}
"""Largest size in bytes of signed and unsigned integers that a recording can store exactly."""
NAME_SHOWN = 60
"""Maximum length of a name in an error message."""
LEAST_INTERVAL_S = 1e-100
"""Shortest accepted interval between samples, so that its inverse is finite."""
SECONDS = {
    **dict.fromkeys(("", "none", "s", "sec", "secs", "sek", "second", "seconds", "sekunden"), 1.0),
    **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds"), 1e-3),
    **dict.fromkeys(("us", "\u03bcs", "usec", "microsecond", "microseconds"), 1e-6),
    **dict.fromkeys(("ns", "nanosecond", "nanoseconds"), 1e-9),
    **dict.fromkeys(("min", "minute", "minutes", "minuten"), 60.0),
    **dict.fromkeys(("h", "hour", "hours", "stunden"), 3600.0),
    **dict.fromkeys(("d", "day", "days", "tage"), 86400.0),
}
"""Length in seconds of each unit of time; case is ignored."""


def rate_bounds(interval: float, uncertainty: float, unit: str) -> tuple[float, float] | None:
    """Return bounds of the sample rate [Hz] for an interval in a unit of time; None if invalid."""
    second = SECONDS.get(unit.casefold(), 0.0)
    shortest, longest = second * (interval - uncertainty), second * (interval + uncertainty)
    return (1 / longest, 1 / shortest) if LEAST_INTERVAL_S < shortest <= longest < inf else None


def text_of(raw: bytes) -> str:
    """Decode a text as UTF-8, or else as Latin-1, because files do not state the encoding."""
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


_UNIT = re.compile(
    r"(?:(?:wf|ni|y|eng(?:ineering)?\.?|phys(?:ical)?|meas(?:ure(?:d|ment)?)?|channel|data|signal|sensor|values?"
    r"|ordinate|display)[ _.-]?)*units?"
    r"(?:[ _.-]?(?:y|labels?|strings?|names?|descriptions?|texts?|of[ _]measure\w*))?"
    r"|eu|einheit(?:en)?|unit[e\u00e9]s?",
    re.I,
)
_SCALE = re.compile(
    r"(?:scale|scaling|(?:(?:scal\w*|cal\w*)[ _]?)?factor|gain|slope|lsb)s?|(?:volts?|v)[ _]?per[ _]?\w+",
    re.I,
)


MOST_CHANNELS = 64
"""Maximum number of values of a fact with one value per channel of a table; larger arrays are samples."""
_COUNT_SCALE = re.compile(
    rf"{_SCALE.pattern}|sens\w*|conv\w*|mult\w*|resol\w*|calib\w*|coeff\w*|sf|c1|to_\w+|units?_per_\w+", re.I
)


def unit_among(facts: Iterable[tuple[str, Any]], place: int = 0) -> str:
    """Return the stated unit, or the unit at ``place`` in a list of units; empty if not stated.

    Several units are joined by "or".
    """
    named = (value for name, value in facts if _UNIT.fullmatch(name))
    return " or ".join(filter(None, dict.fromkeys(_text_at(np.ravel(value), place) for value in named)))


def own_facts(facts: Iterable[tuple[str, Any]], label: str) -> tuple[tuple[str, Any], ...]:
    """Return the facts named after a channel's label, such as ``v_gain`` or ``Unit v``, without the label."""
    before = re.compile(rf"{re.escape(label)}(?=[A-Z _.-])[ _.-]*(.+)|(.+?)[ _.-]+(?:of )?{re.escape(label)}")
    found = ((before.fullmatch(name), value) for name, value in facts if label and label in name)
    return tuple((name[1] or name[2], value) for name, value in found if name)


def _text_at(texts: NDArray[Any], place: int) -> str:
    """Return the text at ``place`` in a list, or the only text in it; for numbers, return an empty text."""
    if not texts.size or texts.dtype.kind not in "SUO":
        return ""
    text = texts[place if texts.size > 1 and place < texts.size else 0]
    # If bytes of variable length are not UTF-8, h5py returns them as surrogates.
    return text_of(text if isinstance(text, bytes) else str(text).encode("utf-8", "surrogateescape")).strip()


def scale_among(facts: Iterable[tuple[str, Any]], *, are_counts: bool = False) -> str:
    """Return a stated scale, such as ``"gain = 0.001"``, whether or not it was applied to the numbers.

    A sensitivity or a calibration is usually already applied, except to integers.
    """
    scale = _COUNT_SCALE if are_counts else _SCALE
    for name, value in facts:
        numbers = np.ravel(value)
        is_scale = scale.fullmatch(name) and numbers.dtype.kind in "iuf" and numbers.size <= MOST_CHANNELS
        if is_scale and np.any(numbers != 1.0):
            return f"{name} = {', '.join(f'{float(each):.6g}' for each in numbers)}"
    return ""


def exact_step(dtype: np.dtype[Any]) -> float | None:
    """Return the step between integers that can be stored exactly; None for other numbers."""
    return 1.0 if dtype.itemsize <= EXACT_KINDS.get(dtype.kind, 0) else None


@dataclass(frozen=True)
class SourceChannel:
    """A channel as described by its file."""

    name: str
    """Unique name in the file, used in mappings."""
    samples: int
    label: str = ""
    """Label in the file; not unique."""
    sample_rate_hz: float | None = None
    """Sample rate; None if the file does not state it exactly."""
    unit: str = ""
    quantity: str = ""
    """Quantity stated in the file, if the file states no unit for the channel."""
    step: float | None = None
    """Step between values that the file stores as integers; knowing the step allows exact storage."""
    origin: Origin | None = None
    """Whether the channel was measured or simulated; None if unknown."""
    full_scale: float | None = None
    """Largest value of the file format, if this is also the full scale of the converter."""
    rate_bounds_hz: tuple[float, float] | None = None
    """Bounds of the sample rate [Hz], if the times have few digits."""
    start_s: float | None = None
    """Time of the first sample on the common clock of the file [s]."""
    start_error_s: float = 0.0
    runs: tuple[tuple[int, int], ...] = ()
    """For each regular stretch, its first sample and that sample's time in intervals; empty without jumps."""
    time_unit: str | None = None
    """Unit of the channel's times, empty if not stated; None without times."""
    stated_scale: str = ""
    """Scale stated in the file; the numbers may or may not include it. Empty if not stated."""
    shifts: tuple[tuple[str, str], ...] = ()
    """Names and values of facts that may shift the times in an unknown way, such as a delay."""
    time_trouble: str = ""
    """Contradiction in the file's time information; empty if there is none."""

    @property
    def title(self) -> str:
        """Name and label of the channel in messages."""
        label = f" ({shorten(self.label, NAME_SHOWN)})" if self.label else ""
        return repr(shorten(self.name, NAME_SHOWN)) + label

    @property
    def are_counts(self) -> bool:
        """Whether the channel's numbers are counts, or fractions of full scale."""
        return self.step == 1.0 or self.full_scale is not None

    @property
    def rates_hz(self) -> tuple[float, float]:
        """Bounds of the sample rate [Hz]; equal if the rate is exact."""
        exact = self.sample_rate_hz
        return (self.rate_bounds_hz or (0.0, inf)) if exact is None else (exact, exact)


Read = Callable[[int, int], Reals]
"""Function that returns the samples of one channel between two indices, shape (stop - start,).

Samples are scaled as the file states; lost samples are NaN.
"""


@dataclass(frozen=True, eq=False)
class Source:
    """An open file to import: all data that can become channels of a recording."""

    readers: Mapping[SourceChannel, Read]
    are_in_order: bool = True
    """Whether the channels are in the order of the file; HDF5 sorts them by name."""

    @property
    def channels(self) -> tuple[SourceChannel, ...]:
        """All channels."""
        return tuple(self.readers)

    def read(self, channel: SourceChannel, start: int, stop: int) -> Reals:
        """Read the samples of a channel from ``start`` to ``stop``."""
        return self.readers[channel](start, stop)

    def blocks(self, channel: SourceChannel) -> Iterator[Reals]:
        """Yield the samples of a channel in blocks."""
        for start in range(0, channel.samples, BLOCK_SAMPLES):
            yield self.read(channel, start, min(start + BLOCK_SAMPLES, channel.samples))


def read_from(values: Reals) -> Read:
    """Return the function that reads a channel whose samples are in memory."""
    return lambda start, stop: values[start:stop]
