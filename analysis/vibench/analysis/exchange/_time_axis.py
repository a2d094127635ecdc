"""Time information in a file of any format: a named rate or interval, or a channel of times."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf
from typing import Any

import numpy as np

from ..errors import InvalidRequest
from ..signals.arrays import Reals
from ._source_channel import SECONDS, SourceChannel, rate_bounds

_UNIT = r"(?:[ _]*[\[(]?(?P<unit>[kM]?Hz|[kM]?S/s|s|sec|ms|us|[\u00b5\u03bc]s)[\])]?)?"
_RATE = re.compile(rf"(?:sampl\w*?[ _]?(?:rate|freq\w*)|f_?s|abtast(?:rate|frequenz)){_UNIT}", re.IGNORECASE)
_INTERVAL = re.compile(
    rf"(?:sampl\w*?[ _]?(?:interval|period|time)|dt|delta[ _]?t|time[ _]?(?:step|increment)){_UNIT}",
    re.IGNORECASE,
)
_TIME = re.compile(
    rf"(?:(?:x|rel|relative)[ _]?)?(?:time|zeit|temps|t)(?:[ _]?(?:stamps?|axis|vector|channel))?{_UNIT}",
    re.IGNORECASE,
)
_HERTZ = {"khz": 1e3, "mhz": 1e6, "ks/s": 1e3, "ms/s": 1e6}
SAME_RATE = 1e-4
"""How far two statements of one sample rate may differ: clocks differ less."""
EVEN = 1e-3
"""How far a sample may lie from its place on an even axis of exactly known rate, in sample intervals."""
_PLACED = 0.1
"""How far it may lie from a place on any even axis, beside the rounding of the times."""
_OFF, _MANY_OFF = 0.25, 0.05
"""Share of intervals, and their relative deviation from the median, above which times have too few digits."""
_COARSE_SPREAD = 1.25
"""Of coarse times about a straight line, in their last digit; more shows that samples are missing."""
_RISING = 0.9
"""Share of its intervals that are not negative in a channel of times."""
_BIN = 512
"""Samples of which the extremes are kept."""
MOST_RUNS = 10_000
_MOST_REPEATED = 100
"""Samples by which times may go back; more is another record."""
FARTHEST = 2**40
"""Sample intervals between two times that are counted at most."""
_LONGEST_PAUSE = 10
"""Lost samples for each one that is kept; more is a wrong time."""


def told_rate_hz(facts: Iterable[tuple[str, Any]]) -> tuple[float | None, str]:
    """Return the sample rate that named numbers state, the nearest first, and why they cannot all be true.

    A number is a rate or an interval, with a unit behind its name: ``"dt_ms"``, ``"Sample rate [kHz]"``.
    """
    said = list(_rates_hz(facts))
    other = next((each for each in said if not agrees(each, (said[0], said[0]))), None)
    trouble = "" if other is None else f"says {said[0]:.9g} and {other:.9g} samples/s"
    return (said[0] if said else None), trouble


def _rates_hz(facts: Iterable[tuple[str, Any]]) -> Iterator[float]:
    for name, value in facts:
        number = np.ravel(value)
        if number.size != 1 or number.dtype.kind not in "iuf" or not 0 < number[0] < inf:
            continue
        if found := _RATE.fullmatch(name.strip()):
            yield float(number[0]) * _HERTZ.get((found["unit"] or "").casefold(), 1.0)
        elif found := _INTERVAL.fullmatch(name.strip()):
            bounds = rate_bounds(float(number[0]), 0.0, found["unit"] or "")
            yield from () if bounds is None else bounds[:1]


def time_unit(channel: SourceChannel) -> str | None:
    """Return the unit of a channel of times, empty where the file states none; None for any other channel."""
    found = _TIME.fullmatch(channel.label.strip())
    if found is None or (channel.unit and channel.unit.casefold() not in SECONDS):
        return None
    return channel.unit or found["unit"] or ""


@dataclass(frozen=True)
class TimeAxis:
    """Where samples lie in time, in the unit of the file."""

    start: float
    interval: float
    uncertainty: float
    """Of the interval; 0 where it is exact."""
    rounding: float
    """Of the start."""
    runs: tuple[tuple[int, int], ...]
    """First sample, and its place in sample intervals, of each stretch without irregularity."""
    trouble: str = ""
    """Why samples cannot be placed."""

    def of(self, channel: SourceChannel, unit: str) -> SourceChannel:
        """Return a channel with these times; what it said of its rate itself must agree."""
        bounds = rate_bounds(self.interval, self.uncertainty, unit)
        told = channel.sample_rate_hz
        if told is not None and not unit:
            # A rate tells in which unit the times are.
            units = {each: rate_bounds(self.interval, self.uncertainty, each) for each in ("s", "ms", "us")}
            unit, bounds = next(((a, b) for a, b in units.items() if b and agrees(told, b)), (unit, bounds))
        second = SECONDS[unit.casefold()]
        trouble = channel.time_trouble or self.trouble
        if told is not None and bounds is not None and not agrees(told, bounds):
            trouble = f"says {told:.9g} samples/s, and its times say {sum(bounds) / 2:.9g}"
        is_exact = bounds is not None and self.uncertainty == 0
        return replace(
            channel,
            sample_rate_hz=told if told is not None or not is_exact or bounds is None else bounds[0],
            rate_bounds_hz=None if is_exact else bounds,
            start_s=self.start * second,
            start_error_s=self.rounding * second,
            runs=self.runs,
            time_unit=unit,
            time_trouble=trouble,
        )


def agrees(rate_hz: float, bounds_hz: tuple[float, float]) -> bool:
    """Return whether a rate lies within bounds, widened by the difference of two clocks."""
    low, high = bounds_hz
    return low * (1 - SAME_RATE) <= rate_hz <= high * (1 + SAME_RATE)


def time_axis(blocks: Iterable[Reals]) -> TimeAxis | None:
    """Place samples by their times, read once in blocks; None where the numbers are no times.

    Times that have too few digits to place single samples are taken as even if they deviate from a straight
    line by no more than their rounding.
    """
    scan: _Scan | None = None
    for block in blocks:
        if scan is None:
            scan = _begin(block)
            if scan is None:
                return None
        scan.add(block)
    return None if scan is None else scan.axis()


def _begin(block: Reals) -> "_Scan | None":
    intervals = np.diff(block)
    rising = intervals[intervals > 0]
    if not rising.size or np.count_nonzero(intervals >= 0) < _RISING * intervals.size or block.size < 2:
        return None
    typical = float(np.median(rising))
    is_near = np.abs(intervals / typical - 1) <= _OFF
    is_coarse = np.count_nonzero(~is_near) > _MANY_OFF * intervals.size + 1
    if is_coarse:
        return _Scan(float(block[-1] - block[0]) / intervals.size, float(np.quantile(rising, 0.01)))
    near = intervals[is_near]
    return _Scan(float(np.mean(near)), min(float(np.ptp(near)) / 2, 0.8 * _OFF * typical))


class _Scan:
    """Times seen so far: extremes of their distance from the even axis, and where they jump."""

    def __init__(self, interval: float, rounding: float) -> None:
        self._interval, self._rounding = interval, rounding
        self._is_coarse = rounding > _OFF * interval
        self._last: tuple[float, int] | None = None
        self._start = 0.0
        self._samples = 0
        self._runs = [(0, 0)]
        self._kept: list[Reals] = []
        self._trouble = ""

    def add(self, block: Reals) -> None:
        """Take the next times."""
        if not np.isfinite(block).all():
            self._trouble = "has times that are not numbers"
            return
        if self._last is None:
            self._start = float(block[0])
            self._last = (self._start - self._interval, -1)
        before, place = self._last
        steps = np.ones(block.size, dtype=np.int64)
        if not self._is_coarse:
            count = np.rint(np.diff(block, prepend=before) / self._interval)
            steps = np.clip(count, -FARTHEST, FARTHEST).astype(np.int64)
        places = place + np.cumsum(steps)
        jumps = np.flatnonzero(steps != 1)[: MOST_RUNS + 1]
        self._runs += [(self._samples + int(at), int(places[at])) for at in jumps]
        distance = block - self._start - self._interval * places
        kept = np.arange(block.size)
        if block.size > _BIN:
            starts = range(0, block.size, _BIN)
            parts = [(first, distance[first : first + _BIN]) for first in starts]
            kept = np.array([first + find(part) for first, part in parts for find in (np.argmin, np.argmax)])
        self._kept.append(np.stack((places[kept], distance[kept])))
        self._last = (float(block[-1]), int(places[-1]))
        self._samples += block.size

    def axis(self) -> TimeAxis:
        """Evaluate the times seen."""
        places, distance = np.concatenate(self._kept, axis=1) if self._kept else np.zeros((2, 1))
        span = max(float(places.max()), 1.0)
        slope, offset = np.polyfit(places / span, distance, 1) if np.ptp(places) else (0.0, 0.0)
        off = distance - slope * places / span - offset
        spread, interval = float(np.ptp(off)), self._interval + float(slope) / span
        allowed = (
            _COARSE_SPREAD * self._rounding if self._is_coarse else 2 * _PLACED * interval + self._rounding
        )
        trouble = self._trouble or _impossible(self._runs, self._samples, span)
        if not trouble and spread > allowed:
            trouble = (
                f"has times up to {spread / interval:.3g} sample intervals off an even axis, and no "
                "whole number of lost samples explains that"
            )
        is_exact = spread < EVEN * interval
        if is_exact:
            before, place = self._last or (self._start, 1)
            interval = (before - self._start) / place if place else interval
        uncertainty = 0.0 if is_exact else spread / span
        start = self._start if is_exact else self._start + float(offset)
        rounding = 2 * self._rounding / self._samples**0.5
        return TimeAxis(start, interval, uncertainty, rounding, tuple(self._runs), trouble)


def _impossible(runs: list[tuple[int, int]], samples: int, span: float) -> str:
    if len(runs) > MOST_RUNS:
        return f"has times that jump more than {MOST_RUNS} times"
    if span > _LONGEST_PAUSE * samples:
        return f"has times for {span:.3g} intervals and {samples} samples"
    return ""


@dataclass(frozen=True)
class Piece:
    """Samples of a file that follow each other evenly."""

    first: int
    """In the file."""
    place: int
    """Of the first one, in sample intervals since the channel's start."""
    samples: int

    @property
    def end(self) -> int:
        """Place after the last one."""
        return self.place + self.samples


def pieces(channel: SourceChannel) -> tuple[Piece, ...]:
    """Cut a channel where its times jump; samples at places that come twice are left out, both times.

    Raises InvalidRequest when the times go back by more than a few samples: two records were joined.
    """
    starts = channel.runs or ((0, 0),)
    kept: list[Piece] = []
    end = 0
    for (first, place), (stop, _) in pairwise((*starts, (channel.samples, 0))):
        back = max(0, end - place)
        if back > _MOST_REPEATED:
            raise InvalidRequest(
                f"the times of {channel.name} go back by {back} samples at its sample {first}, as if two "
                'records were joined; export each by itself, or give time = "even" to ignore the times'
            )
        while back and kept and kept[-1].end > place:
            last = kept.pop()
            if last.place < place:
                kept.append(replace(last, samples=place - last.place))
        if stop - first > back:
            kept.append(Piece(first + back, place + back, stop - first - back))
        end = max(end, place + stop - first)
    return tuple(kept)
