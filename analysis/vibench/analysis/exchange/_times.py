"""Read sample rates, start times and time axes that a file states or contains."""

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from itertools import chain, pairwise
from math import inf, isfinite, nan
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from ..signals import Reals
from ._source_channel import MOST_CHANNELS, SECONDS, SourceChannel, own_facts, rate_bounds, text_of

_HERTZ = {"hz": 1.0, "s/s": 1.0, "khz": 1e3, "mhz": 1e6, "ks/s": 1e3, "ms/s": 1e6}
UNITS = {*_HERTZ, *SECONDS, "\u00b5s"} - {""}
_WORDS = "|".join(re.escape(each) for each in sorted(UNITS, key=len, reverse=True))
_UNIT = rf"(?:[ _/,]*(?:in )?[\[(]?(?P<unit>{_WORDS})[\])]?)?"
_RATE = re.compile(
    rf"(?:(?:(?:samp\w*?|scan|acq\w*|daq|(?:nominal[ _]?)?s)[ _]?)?rate|(?:sampl|acq)\w*?[ _]?freq\w*"
    rf"|samples[ _]?per[ _]?sec\w*|f_?s(?:amp\w*)?|freq\w*[ _]?sampl\w*|sr|sps|sfreq"
    rf"|abtast(?:rate|frequenz)){_UNIT}",
    re.IGNORECASE,
)
_INTERVAL = re.compile(
    r"(?:(?:samp\w*?|scan)[ _]?(?:interval|period|time)|(?:t(?:ime)?[ _]?)?interval|t_?s(?:amp\w*)?"
    r"|(?:d|delta)[ _]?[tx]|[tx][ _]?(?:d|delta|step)|time[ _]?(?:step|delta)"
    r"|(?:(?:time|wf|x|abscissa)[ _]?)?(?:incr?(?:ement)?|spacing))"
    rf"{_UNIT}",
    re.IGNORECASE,
)
_START = re.compile(
    r"(?:(?:(?:wf|time|t|x)[ _]?)?start(?:ing)?(?:[ _]?(?:time|offset|value))?|[tx]_?0"
    rf"|(?:time|t|x|abscissa)[ _]?(?:offset|zero|origin|first|min)|first[ _]?(?:time|t|x)){_UNIT}",
    re.IGNORECASE,
)
_DELAY = re.compile(r".*(?:delay|latenc|skew|shift).*", re.IGNORECASE)
_SHIFT = re.compile(
    r".*(?:delay|latency|skew|shift|clock|trigger|first[ _]?sample|sample[ _]?offset).*"
    r"|(?:.*[ _])?(?:lag|begin)(?:[ _].*)?",
    re.IGNORECASE,
)
_AXIS_UNIT = re.compile(
    r"(?:(?:wf|x|abscissa|axis|time|d?t)[ _]?)+units?(?:[ _]?(?:strings?|labels?|names?))?", re.IGNORECASE
)
_TIME = re.compile(
    rf"(?:(?:x|rel|relative|elapsed)[ _]?)?(?:times?|zeit|temps|t|sec|seconds|sekunden)"
    rf"(?:[ _]?(?:stamps?|axis|vector|channel))?{_UNIT}",
    re.IGNORECASE,
)
_QUANTITY = re.compile(r"\s*([-+]?\d*\.?\d+\.?(?:e[-+]?\d+)?)\s*([a-z/\u00b5\u03bc]*)\s*", re.IGNORECASE)
_LAST_DIGIT = re.compile(r"\.(?P<decimals>\d*)(?:e(?P<power>[-+]?\d+))?", re.IGNORECASE)
SAME_RATE = 1e-4
"""Relative tolerance between two stated sample rates; different clocks deviate by less."""
EVEN = 1e-3
"""Largest spread of times around an even axis at which the rate counts as exact [sample intervals]."""
_PLACED = 0.1
"""Tolerated distance of a time from an even axis, in addition to rounding [sample intervals]."""
_OFF, _MANY_OFF = 0.25, 0.05
"""Smallest deviation of irregular intervals from multiples of the usual interval; their largest fraction."""
_SINGLE = 0.2
"""Quantile of the intervals that equals one sample interval, even if two in five samples were lost."""
_LEAST_ROUNDED = 3
"""Minimum number of unusual intervals to recognize rounding; fewer could be due to regular losses."""
_JITTER, _OUTLIERS = 0.04, 0.03
"""Largest range of jitter beyond rounding [sample intervals]; fraction of outliers ignored on each side."""
_COARSE_SPREAD = 1.25
"""Largest range of deviations of coarse times from a line [last digits]; lost samples exceed this range."""
_RISING = 0.9
"""Minimum fraction of non-negative intervals in a channel of times."""
_BIN = 512
"""Number of time stamps in a group; only the smallest and the largest deviation of each group are kept."""
_LAST = 64
"""Number of time stamps from which the resolution is determined."""
_LEAST_RISING = 64
"""Minimum number of evenly rising values that count as times in a channel whose name does not mean time."""
TIME_UNITS = ("s", "ms", "us", "ns", "min", "h", "d")
_NO_UNITS = {*SECONDS, "-", "1", "#", "samples"}
MOST_RUNS = 10_000
FARTHEST = 2**40
"""Largest gap between two times that can be counted [sample intervals]."""
_DATENUM = (693_000, 770_000)
"""Range of MATLAB's ``datenum`` (days since the year 0) that is taken as a date: 1897 to 2108."""
_LONGEST_PAUSE = 10
"""Largest ratio of time span [sample intervals] to number of samples; a larger one means wrong times."""


def stated_times(
    facts: Iterable[tuple[str, Any]], elsewhere: Iterable[tuple[str, Any]] = ()
) -> dict[str, Any]:
    """Return the time fields of a `SourceChannel` from facts in a file; the channel's own facts prevail.

    A fact is a sample rate, an interval, a start, or a unit of these. A name may end with the unit:
    ``"dt_ms"``, ``"Sample rate [kHz]"``. If no fact states a rate, rates stated elsewhere in the file apply.
    """
    facts = tuple(facts)
    start_s, start_error_s = stated_start(facts)
    units = {name.strip().casefold(): _text(value).strip() for name, value in facts if "unit" in name.lower()}
    axis = next((unit for name, unit in units.items() if _AXIS_UNIT.fullmatch(name)), "")
    others = (each for each in elsewhere if _RATE.fullmatch(each[0].strip()))
    rates_hz = list(_rates_hz(facts, units, axis)) or list(_rates_hz(others, units, axis))
    other = next((each for each in rates_hz if not agrees(each, (rates_hz[0], rates_hz[0]))), None)
    trouble = "" if other is None else f"states both {rates_hz[0]:.9g} and {other:.9g} samples/s"
    for name, value in facts:
        is_of_times = any(form.fullmatch(name.strip()) for form in (_RATE, _INTERVAL, _START, _DELAY))
        if is_of_times and _are_several(value) and len({*np.ravel(value)}) > 1:
            trouble = f"states several different values of {name}"
    if axis.casefold() not in SECONDS:
        trouble = f"has an axis in {axis!r} instead of times"
    return {
        "sample_rate_hz": rates_hz[0] if rates_hz else None,
        "time_trouble": trouble,
        "start_s": start_s,
        "start_error_s": start_error_s,
        "shifts": tuple(
            (name, _text(value))
            for name, value in facts
            if _SHIFT.fullmatch(name.strip()) or (_START.fullmatch(name.strip()) and _moment(value) is None)
        ),
    }


def _rates_hz(facts: Iterable[tuple[str, Any]], units: Mapping[str, str], axis: str) -> Iterator[float]:
    for name, value in facts:
        number, unit = _number(value)
        if not 0 < number < inf:
            continue
        named = (f"{name.strip().casefold()}{end}" for end in ("_unit", "_units", " unit", " units"))
        unit = unit or next((units[each] for each in named if each in units), "")
        if found := _RATE.fullmatch(name.strip()):
            yield number * _HERTZ.get((found["unit"] or unit).casefold(), 1.0)
        elif found := _INTERVAL.fullmatch(name.strip()):
            bounds = rate_bounds(number, 0.0, found["unit"] or unit or axis)
            yield from () if bounds is None else bounds[:1]


def _number(value: Any) -> tuple[float, str]:
    """Return a single number, which may be written as text, and its unit; NaN for anything else."""
    found = _QUANTITY.fullmatch(_text(value))
    return (nan, "") if found is None else (float(found[1]), found[2])


def _text(value: Any) -> str:
    single = np.ravel(value)
    if single.size != 1 and not (_are_several(single) and np.all(single == single[0])):
        return ""
    return text_of(single[0]) if isinstance(single[0], bytes) else str(single[0])


def _are_several(value: Any) -> bool:
    """Return whether a fact has one plain value for each channel of a table."""
    return 1 < np.size(value) <= MOST_CHANNELS and np.ravel(value).dtype.kind in "iufSU"


def stated_start(facts: Iterable[tuple[str, Any]]) -> tuple[float | None, float]:
    """Return the stated time of a channel's first sample and its rounding error [s].

    The channel's own facts take precedence. If the file states a date and an offset, as in NI waveforms,
    their sum is returned.
    """
    moments, offsets = [], []
    for name, value in facts:
        if (found := _START.fullmatch(name.strip())) is None:
            continue
        number, unit = _number(value)
        if isfinite(number):
            unit = found["unit"] or unit or ("d" if _DATENUM[0] < number < _DATENUM[1] else "")
            second = SECONDS.get(unit.casefold(), 1.0)
            offsets.append((number * second, _rounding(value) * second if number else 0.0))
        elif (moment_s := _moment(value)) is not None:
            moments.append((moment_s, _rounding(value, whole=0.0)))
    used = (*moments[:1], *offsets[:1])
    return (sum(start_s for start_s, _ in used) if used else None), sum(error_s for _, error_s in used)


def _rounding(value: Any, *, whole: float = 0.5) -> float:
    """Return half a unit of the last digit of a number or date in text form; ``whole`` if none."""
    if np.asarray(value).dtype.kind not in "SUO":
        return 0.0
    digits = _LAST_DIGIT.search(_text(value))
    return whole if digits is None else 0.5 * 10.0 ** (int(digits["power"] or 0) - len(digits["decimals"]))


def _moment(value: Any) -> float | None:
    """Return a number, or an ISO date in seconds since 1970; None for other texts."""
    number, _ = _number(value)
    if isfinite(number):
        return number
    with suppress(ValueError):
        moment = datetime.fromisoformat(_text(value).strip())
        return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
    return None


def time_axis(channel: SourceChannel, blocks: Iterable[Reals]) -> "TimeAxis | None":
    """Return the time axis of a channel that contains times, read once in blocks; None for other channels.

    A channel that rises evenly, without the unit of another quantity, counts as times or sample numbers.
    """
    found = _TIME.fullmatch(channel.label.strip())
    # Climate and Forecast conventions, 4.4: "seconds since 2026-03-01".
    unit = re.sub(r"\s+since\s.*", "", channel.unit.casefold())
    first = next(iterator := iter(blocks), np.empty(0))
    scan = _begin(first) if found is not None or unit in _NO_UNITS else None
    is_named = found is not None and unit in SECONDS
    # If all times are equal, they were rounded too coarsely to contradict the stated rate.
    if is_named and scan is None and np.ptp(first) != 0 and _is_time(channel, found, first):
        trouble = "has times that do not rise; sort the rows by time"
        return TimeAxis(float(first[0]), 1.0, 0.0, 0.0, (), trouble, unit=None, is_named=True)
    is_even = scan is not None and first.size >= _LEAST_RISING and not (scan.is_coarse or scan.is_inferred)
    if scan is None or not (is_named or is_even):
        return None
    for block in chain((first,), iterator):
        scan.add(block)
    axis = scan.axis()
    if found is not None and is_named:
        return replace(axis, unit=unit or found["unit"] or "", is_named=True)
    if axis.interval == 1:
        return replace(axis, unit=None)
    # Evenly rising values under another name may have any unit: the mapping must confirm the rate.
    uncertainty = max(axis.uncertainty, 1e-12 * axis.interval)
    return replace(axis, unit=unit if unit in SECONDS else "", uncertainty=uncertainty)


def is_time_of(name: str, label: str) -> bool:
    """Return whether a name means the time of the channel with a label, such as ``t_v`` or ``v time``."""
    return any(_TIME.fullmatch(rest) for rest, _ in own_facts([(name, None)], label))


def _is_time(channel: SourceChannel, found: "re.Match[str] | None", first: Reals) -> bool:
    """Return whether a column contains times; the name "t" without a unit may also mean a temperature."""
    if found is not None and (channel.unit or found["unit"]):
        return True
    steps = np.diff(np.sort(first))
    typical = max(float(np.median(steps)), np.finfo(float).tiny)
    return bool(np.count_nonzero(np.abs(steps / typical - 1) > _OFF) <= _MANY_OFF * steps.size)


@dataclass(frozen=True)
class TimeAxis:
    """Times of samples in the unit of the file."""

    start: float
    interval: float
    uncertainty: float
    """Uncertainty of the sample interval; 0 if exact."""
    rounding: float
    """Uncertainty of the start time, caused by rounding."""
    runs: tuple[tuple[int, int], ...]
    """For each regular stretch: its first sample, and the time of that sample in sample intervals."""
    trouble: str = ""
    """Reason why the times cannot be used; empty if they can be used."""
    unit: str | None = ""
    """Unit of the times; empty if not stated, None for sample numbers."""
    is_named: bool = False
    """Whether the name of the channel means time."""

    @property
    def moments(self) -> tuple[object, ...]:
        """Start and runs of the times; channels sampled at the same times have the same start and runs."""
        return round(self.start / self.interval, 2), self.runs

    def of(self, channel: SourceChannel) -> SourceChannel:
        """Return a channel with these times, and an error text if the times contradict its stated rate.

        Sample numbers (no unit) only show which samples are missing.
        """
        trouble = channel.time_trouble or self.trouble
        if (unit := self.unit) is None:
            return replace(channel, runs=self.runs, time_trouble=trouble)
        bounds = rate_bounds(self.interval, self.uncertainty, unit)
        rate = channel.sample_rate_hz
        if rate is not None and not unit:
            # Choose the unit of the times that agrees with the stated rate.
            units = {each: rate_bounds(self.interval, self.uncertainty, each) for each in TIME_UNITS}
            unit, bounds = next(((a, b) for a, b in units.items() if b and agrees(rate, b)), (unit, bounds))
        second = SECONDS[unit.casefold()]
        if rate is not None and bounds is not None and not agrees(rate, bounds):
            trouble = f"states {rate:.9g} samples/s, but its times give {sum(bounds) / 2:.9g}"
        is_exact = bounds is not None and self.uncertainty == 0
        return replace(
            channel,
            sample_rate_hz=rate if rate is not None or not is_exact or bounds is None else bounds[0],
            rate_bounds_hz=None if is_exact else bounds,
            # Times that begin at zero are relative to the channel's stated start.
            start_s=self.start * second
            + ((channel.start_s or 0.0) if abs(self.start) < self.interval else 0.0),
            start_error_s=self.rounding * second + channel.start_error_s,
            runs=self.runs,
            time_unit=unit,
            time_trouble=trouble,
        )


def agrees(rate_hz: float, bounds_hz: tuple[float, float]) -> bool:
    """Return whether a rate is within bounds that are widened by the largest difference of two clocks."""
    low, high = bounds_hz
    return low * (1 - SAME_RATE) <= rate_hz <= high * (1 + SAME_RATE)


def _begin(block: Reals) -> "_Scan | None":
    block = block[np.isfinite(block)]
    intervals = np.diff(block)
    rising = intervals[intervals > 0]
    if not rising.size or np.count_nonzero(intervals >= 0) < _RISING * intervals.size or block.size < 2:
        return None
    # A lost sample doubles an interval. Rounding adds at most a third if samples can be counted at all.
    typical = float(np.median(rising[rising <= 1.4 * np.quantile(rising, _SINGLE)]))
    is_near = np.abs(intervals / typical - 1) <= _OFF
    # Repeated and coarse times have intervals of zero, which lost samples do not explain.
    is_off = np.abs(intervals / typical - np.maximum(np.rint(intervals / typical), 1)) > _OFF
    mean = float(block[-1] - block[0]) / intervals.size
    many = _MANY_OFF * intervals.size + (intervals.size > 2)
    digit = float(np.max(_resolution(block[np.newaxis], typical)))
    if np.count_nonzero(is_off) > many:
        is_repeated = np.count_nonzero(intervals == 0) > many
        rounding = float(np.quantile(rising, 0.01)) if is_repeated else digit
        return _Scan(mean, rounding, is_inferred=True)
    are_many_lost = bool(np.count_nonzero(~is_near) > many)
    # Rounding to whole last digits makes intervals of 1.04 digits look like one lost sample in 25. But a loss
    # moves all later times away from a line, while rounding moves each time by at most half a digit.
    off = np.abs(intervals[~is_near] - typical)
    is_digit = off.size >= _LEAST_ROUNDED and 0.9 * float(np.min(off)) < digit
    if is_digit and _distance_from_line(block) < _COARSE_SPREAD * digit:
        return _Scan(mean, digit)
    near = intervals[is_near]
    rounding = min(float(np.ptp(near)) / 2, 0.8 * _OFF * typical)
    return _Scan(float(np.mean(near)), rounding, is_inferred=are_many_lost)


def _distance_from_line(times: Reals) -> float:
    place = np.arange(times.size) / times.size
    apart = times - times[0]
    return float(np.ptp(apart - np.polyval(np.polyfit(place, apart, 1), place)))


def _resolution(times: Reals, interval: float) -> Reals:
    """Return the rounding unit of the last times in each row, shape (rows,): decimal digits or float steps.

    The unit is larger at later times if numbers have a fixed number of significant digits.
    """
    last = times[:, -_LAST:]
    unit = np.spacing(np.max(np.abs(last), axis=1))
    for digit in 10.0 ** (np.floor(np.log10(interval)) + np.arange(-2, 2)):
        places = last / digit
        is_whole = np.abs(places - np.rint(places)) <= 4 * np.spacing(np.abs(places))
        unit = np.where(np.all(is_whole, axis=1), np.maximum(unit, digit), unit)
    with np.errstate(over="ignore"):
        single = last.astype(np.float32)
    are_single = np.all(np.abs(last - single) <= unit[:, np.newaxis] / 2, axis=1)
    steps = np.spacing(np.max(np.abs(single), axis=1)).astype(np.float64)
    return np.asarray(np.where(are_single, np.maximum(unit, steps), unit))


def _jitter(times: Reals, distance: Reals, interval: float, unit: float) -> float:
    """Return the largest range of the times' distances from a line, minus the part due to rounding."""
    width = min(_BIN, times.size)
    starts = np.minimum(np.arange(0, times.size, width), times.size - width)
    rows, off = (sliding_window_view(each, width)[starts] for each in (times, distance))
    units = np.maximum(_resolution(rows, interval), unit)
    place = np.linspace(-1.0, 1.0, width)
    off = off - np.mean(off, axis=1, keepdims=True)
    off = off - np.outer(off @ place / np.sum(place**2), place)
    low, high = np.quantile(off, (_OUTLIERS, 1 - _OUTLIERS), axis=1)
    # The next row may have a larger unit, and the times with that unit may begin within this row.
    return float(np.max(high - low - _COARSE_SPREAD * np.maximum(units, np.append(units[1:], 0.0))))


class _Scan:
    """Scan of times; it keeps the jumps and the largest deviations from an even axis."""

    def __init__(self, interval: float, rounding: float, *, is_inferred: bool = False) -> None:
        self._interval, self._rounding, self.is_inferred = interval, rounding, is_inferred
        self.is_coarse = rounding > _OFF * interval
        self._last: tuple[float, int] | None = None
        self._start = 0.0
        self._samples = 0
        self._runs = [(0, 0)]
        self._kept: list[Reals] = []
        self._jitter = 0.0
        self._digit = rounding if self.is_coarse else 0.0
        self._squares, self._products = np.zeros((2, 2)), np.zeros(2)
        self._spreads: list[float] = []
        self._trouble = ""

    def add(self, block: Reals) -> None:
        """Add the next block of times."""
        if not np.isfinite(block).all():
            self._trouble = "has times that are not numbers"
            return
        if self._last is None:
            self._start = float(block[0])
            self._last = (self._start - self._interval, -1)
        before, place = self._last
        steps = np.ones(block.size, dtype=np.int64)
        if not self.is_coarse:
            count = np.rint(np.diff(block, prepend=before) / self._interval)
            steps = np.clip(count, -FARTHEST, FARTHEST).astype(np.int64)
        places = place + np.cumsum(steps)
        jumps = np.flatnonzero(steps != 1)[: MOST_RUNS + 1]
        self._runs += [(self._samples + int(at), int(places[at])) for at in jumps]
        distance = block - self._start - self._interval * places
        unit = self._rounding if self.is_coarse else 0.0
        self._digit = max(self._digit, float(np.max(_resolution(block[np.newaxis], self._interval))))
        if block.size > 2:
            self._jitter = max(self._jitter, _jitter(block, distance, self._interval, unit))
        kept = np.arange(block.size)
        parts = [(first, distance[first : first + _BIN]) for first in range(0, block.size, _BIN)]
        self._spreads += [float(np.ptp(part)) for _, part in parts]
        if block.size > _BIN:
            kept = np.array([first + find(part) for first, part in parts for find in (np.argmin, np.argmax)])
        self._kept.append(np.stack((places[kept], distance[kept])))
        powers = np.stack((np.ones(block.size), places)).astype(np.float64)
        self._squares += powers @ powers.T
        self._products += powers @ distance
        self._last = (float(block[-1]), int(places[-1]))
        self._samples += block.size

    def axis(self) -> TimeAxis:
        """Return the time axis fitted to all times that were added."""
        places, distance = np.concatenate(self._kept, axis=1) if self._kept else np.zeros((2, 1))
        span = max(float(places.max()), 1.0)
        scale = np.array([1.0, 1.0 / span])
        # In a line fitted to all times, rounding errors cancel.
        offset, slope = np.linalg.lstsq(
            self._squares * np.outer(scale, scale), self._products * scale, rcond=None
        )[0].tolist()
        off = distance - slope * places / span - offset
        spread, interval = float(np.ptp(off)), self._interval + slope / span
        allowed = (
            _COARSE_SPREAD * self._rounding if self.is_coarse else 2 * _PLACED * interval + self._rounding
        )
        trouble = self._trouble or _time_fault(self._runs, self._samples, span)
        if not trouble and spread > allowed:
            trouble = (
                f"has times that deviate by up to {spread / interval:.3g} sample intervals from an evenly "
                "spaced axis: they are uneven, or have too few digits to count lost samples"
            )
        if not trouble and self._jitter > _JITTER * interval:
            trouble = (
                f"has times that jitter by {self._jitter / interval:.2g} sample intervals, more than the "
                "rounding of their digits explains"
            )
        is_exact = spread < EVEN * interval
        if is_exact:
            before, place = self._last or (self._start + interval, 1)
            interval = (before - self._start) / place if place else interval
        # Rounded times may have equal intervals in spite of lost samples: the mapping must state the rate.
        uncertainty = 1e-12 * interval * self.is_inferred if is_exact else spread / span
        start = self._start if is_exact else self._start + offset
        # If rounding repeats a pattern, all times may be shifted by the part of a digit beyond their spread.
        local = min(spread, float(np.median(self._spreads or [0.0])), self._digit) * (not is_exact)
        rounding = 2 * self._digit / max(self._samples, 1) ** 0.5 + (self._digit - local) / 2
        return TimeAxis(start, interval, uncertainty, rounding, tuple(self._runs), trouble)


def _time_fault(runs: list[tuple[int, int]], samples: int, span: float) -> str:
    if len(runs) > MOST_RUNS:
        return f"has more than {MOST_RUNS} jumps in its times"
    if span > _LONGEST_PAUSE * samples:
        return f"has times that span {span:.3g} sample intervals, but only {samples} samples"
    return ""


def restarts(
    starts_s: Mapping[int, float], rate_hz: float | None, samples: int
) -> tuple[tuple[tuple[int, int], ...], str]:
    """Return the runs (see `TimeAxis`) of a channel with several start times, and a contradiction if any."""
    runs = [(0, 0)]
    first_s = next(iter(starts_s.values()), 0.0)
    for (_, before_s), (sample, start_s) in pairwise(starts_s.items()):
        place = min((start_s - first_s) * (rate_hz or nan), float(FARTHEST))
        if start_s == before_s or abs(place - sample - runs[-1][1] + runs[-1][0]) < _PLACED:
            continue
        if not abs(place - np.rint(place)) <= _PLACED:
            return (), f"has a second start at sample {sample}, {place:.3f} sample intervals after the first"
        runs.append((sample, round(place)))
    return tuple(runs), _time_fault(runs, samples, runs[-1][1] + samples - runs[-1][0])
