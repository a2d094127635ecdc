"""Find values that a stuck converter holds or repeats, and zeros that pad a record."""

from collections.abc import Iterator

import numpy as np

from vibench.acquisition.plan import AbstractExcitation, Family

from ..recordings.channels import BASE, DRIVE
from ..signals.arrays import Reals
from ._alignment import Piece
from ._mapping import KNOWN_ROLES, ChannelMapping
from ._source_channel import Source, SourceChannel

_VIBRATING = {"velocity", "acceleration", "displacement", "force"}
"""Quantities that vary during every test; others, such as a temperature or a trigger, may stay constant."""
_DRIVEN = {DRIVE, "amplifier_voltage", BASE}
_FEWEST, _LONGER = 16, 4
"""Minimum number of equal samples at the end that count as held; minimum ratio to the longest other run."""
_WEAK_STEPS = 3.0
"""Largest distance of neighbours from a constant value [converter steps] in a weak signal (not held)."""
_PATTERN, _FEWEST_VALUES = 64, 16
"""Number of last samples to search for earlier in the record; minimum number of distinct values in them."""
_SEARCHED = 1 << 17
"""Number of samples at the end of a record in which repeated samples are searched for."""
_JUMP = 0.02
"""Minimum jump at the start of repeated samples, relative to their span; a periodic motion has no jump."""
_SAME_TURNS = 1e-3
"""Largest difference from whole drive periods at which repeated samples count as a periodic motion."""


def held_values(
    source: Source,
    channel: SourceChannel,
    pieces: tuple[Piece, ...],
    mapped: ChannelMapping,
    excitation: AbstractExcitation,
    rate_hz: float,
) -> Iterator[tuple[int, int, str]]:
    """Yield first sample, end and description of each stretch without new values.

    A driven channel is not constant for a period of the lowest frequency. Exceptions are weak signals of a
    coarse converter (also until the next hit or burst), exact zeros before a hit, and exact zeros between
    hits or bursts in drive and base.
    """
    quantity, _ = mapped.kind
    if mapped.role not in KNOWN_ROLES and quantity not in _VIBRATING:
        return
    is_noise, is_drive = excitation.family is Family.NOISE, mapped.role in _DRIVEN or quantity == "force"
    runs, step = _runs(source, channel)
    period = max(_FEWEST, int(rate_hz / excitation.band_hz[0]) + 1)
    natural = [b - a for a, b in runs if b - a < period and b < channel.samples]
    at_end = min(period, max(_FEWEST, _LONGER * max(natural, default=0)))
    for start, stop in runs:
        if not (at_end if stop == channel.samples else period) <= stop - start < channel.samples:
            continue
        (value,) = source.read(channel, start, start + 1)
        near = source.read(channel, max(0, start - _FEWEST), start)
        if not is_noise:
            after = source.read(channel, stop, min(stop + _FEWEST, channel.samples))
            near = np.concatenate((near, after))
        is_weak = np.all(np.abs(near - value) <= _WEAK_STEPS * step)
        may_rest = is_noise and value == 0.0 and (start == 0 or is_drive)
        if not is_weak and not may_rest:
            yield start, stop, f"holds {value:.6g}"
    first = max(0, channel.samples - _SEARCHED)
    times = np.concatenate([each.span(first, channel.samples) for each in pieces])
    end = source.read(channel, channel.samples - times.size, channel.samples)
    if repeated := _repeated(end, times / rate_hz, excitation):
        yield channel.samples - repeated, channel.samples, "repeats earlier values"


def _runs(source: Source, channel: SourceChannel) -> tuple[list[tuple[int, int]], float]:
    """Return the runs of at least `_LONGER` equal values, and the smallest step between values."""
    runs: list[tuple[int, int]] = []
    first, place, before, step = 0, 0, np.nan, np.inf
    for block in source.blocks(channel):
        steps = np.abs(np.diff(block, prepend=before))
        step = min(step, float(np.min(steps, where=steps > 0, initial=np.inf)))
        changes = place + np.flatnonzero(steps != 0)
        place, before = place + block.size, block[-1]
        ends = np.append(changes, place) if place == channel.samples else changes
        starts = np.append(first, ends[:-1])
        is_long = ends - starts >= _LONGER
        runs += zip(starts[is_long].tolist(), ends[is_long].tolist(), strict=True)
        first = int(changes[-1]) if changes.size else first
    return runs, step


def _repeated(values: Reals, times_s: Reals, excitation: AbstractExcitation) -> int:
    """Return the number of last values that repeat earlier ones exactly; 0 for a periodic motion."""
    last = values.size - 1
    if last < _PATTERN or np.unique(values[-_PATTERN:]).size < _FEWEST_VALUES:
        return 0
    found = np.arange(_PATTERN - 1, last)
    for back in range(_PATTERN):
        found = found[values[found - back] == values[last - back]]
    if not found.size:
        return 0
    lag = last - int(found[-1])
    differs = np.flatnonzero(values[lag:] != values[:-lag])
    plan = excitation.model_dump(include={"frequency_hz", "frequencies_hz", "repetition_hz"})
    lag_s = times_s[last] - times_s[last - lag]
    turns = np.hstack([each for each in plan.values() if each is not None] or [np.nan]) * lag_s
    if not differs.size or np.any(np.abs(turns - np.rint(turns)) < _SAME_TURNS):
        return 0
    start = lag + int(differs[-1]) + 1
    first = max(lag, start - _PATTERN)
    jump = np.max(np.abs(values[first:start] - values[first - lag : start - lag]))
    return values.size - start if jump > _JUMP * np.ptp(values[start:]) else 0
