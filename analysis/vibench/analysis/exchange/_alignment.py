"""Channels of a file on one time axis: aligned by the times in the file, or refused."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf
from pathlib import Path

from ..errors import InvalidRequest
from ._mapping import ImportMapping
from ._source_channel import SECONDS, SourceChannel
from ._time_axis import Piece, agrees, pieces

_APART = 0.1
"""Largest offset, in sample intervals, that channels analysed together may have."""
_IGNORE = 'give time = "even" and sample_rate_hz in the mapping to ignore it'
_UNITS = ("s", "ms", "us")


@dataclass(frozen=True, eq=False)
class Alignment:
    """Where the samples of channels lie on one axis of even intervals."""

    rate_hz: float
    places: int
    """Sample intervals from the first sample of any channel to the last that all have."""
    pieces: tuple[tuple[Piece, ...], ...]
    """Of each channel."""
    late_s: tuple[float, ...]
    """How much later than its place each channel was sampled, less than half an interval."""
    remarks: tuple[str, ...]
    """Time information in the file beyond a rate, and its replacement by the mapping."""


def align(channels: Sequence[SourceChannel], mapping: ImportMapping, path: Path) -> Alignment:
    """Put channels on one time axis.

    Raises InvalidRequest when the file contradicts itself or the mapping, or cannot be put on one axis.
    """
    remarks = dict.fromkeys(_overridden(channels, mapping))
    placed = [_with_unit(each, mapping) for each in channels]
    for each in placed:
        if each.time_trouble:
            raise InvalidRequest(
                f"{path.name} {each.time_trouble} ({each.name}); export it again, or {_IGNORE}"
            )
    rate_hz = _rate_hz(placed, mapping, path)
    offsets = _offsets(placed, rate_hz, path)
    cut = [
        tuple(replace(one, place=one.place + round(offset)) for one in pieces(each))
        for each, offset in zip(placed, offsets, strict=True)
    ]
    lengths = {each.samples for each in placed}
    if len(lengths) > 1 and not any(offsets) and not any(len(each.runs) > 1 for each in placed):
        said = ", ".join(f"{each.name} {each.samples}" for each in placed)
        raise InvalidRequest(
            f"the channels of {path.name} differ in their numbers of samples ({said}), and those of a "
            "recording share one clock; choose channels of one length"
        )
    places = min(each[-1].end for each in cut)
    if places <= max(each[0].place for each in cut):
        raise InvalidRequest(f"the channels of {path.name} were recorded one after the other; choose others")
    for each, offset, own in zip(placed, offsets, cut, strict=True):
        if offset:
            remarks[f"{each.name} starts {offset / rate_hz:.6g} s after the first channel"] = None
        if len(own) > 1 or own[-1].end - own[0].place != each.samples:
            missing = own[-1].end - own[0].place - sum(one.samples for one in own)
            remarks[f"the times of {each.name} jump; {missing} samples are lost there"] = None
    late_s = tuple((offset - round(offset)) / rate_hz for offset in offsets)
    return Alignment(rate_hz, places, tuple(cut), late_s, tuple(remarks))


def _overridden(channels: Sequence[SourceChannel], mapping: ImportMapping) -> Iterator[str]:
    given = mapping.sample_rate_hz
    for each in channels:
        if mapping.time == "even":
            low, high = each.rates_hz
            told = "no sample rate" if high == inf else f"{(low + high) / 2:.9g} samples/s"
            runs = f", jumps {len(each.runs) - 1} times" if len(each.runs) > 1 else ""
            start = f", starts at {each.start_s:.9g} s" if each.start_s else ""
            trouble = f", {each.time_trouble}" if each.time_trouble else ""
            said = f"{told}{start}{runs}{trouble}"
            yield f"the mapping's {given:.9g} samples/s replace what the file says ({said})"
        elif each.time_unit is not None and mapping.time_unit not in {None, each.time_unit}:
            said = each.time_unit or "no unit"
            yield f"times are in {mapping.time_unit} according to the mapping; the file says {said}"
        elif each.time_unit == "" and given is not None:
            unit = _with_unit(each, mapping).time_unit
            if unit:
                yield f"times without a unit are taken as {unit}, to match the mapping's sample rate"


def _with_unit(channel: SourceChannel, mapping: ImportMapping) -> SourceChannel:
    """Return a channel with times in the unit of the mapping, or in one that agrees with its sample rate."""
    if mapping.time == "even":
        return SourceChannel(channel.name, channel.samples, channel.label)
    if channel.time_unit is None:
        return channel
    if mapping.time_unit is not None:
        return _in_unit(channel, mapping.time_unit)
    if channel.time_unit or mapping.sample_rate_hz is None:
        return channel
    tried = (_in_unit(channel, unit) for unit in _UNITS)
    fits = (each for each in tried if agrees(mapping.sample_rate_hz, each.rates_hz))
    return next(fits, channel)


def _in_unit(channel: SourceChannel, unit: str) -> SourceChannel:
    factor = SECONDS[unit] / SECONDS[(channel.time_unit or "").casefold()]
    exact, bounds = channel.sample_rate_hz, channel.rate_bounds_hz
    return replace(
        channel,
        sample_rate_hz=None if exact is None else exact / factor,
        rate_bounds_hz=None if bounds is None else (bounds[0] / factor, bounds[1] / factor),
        start_s=None if channel.start_s is None else channel.start_s * factor,
        start_error_s=channel.start_error_s * factor,
        time_unit=unit,
    )


def _rate_hz(channels: Sequence[SourceChannel], mapping: ImportMapping, path: Path) -> float:
    """Give the mapping's rate, or the file's where it has none."""
    said = sorted({each.sample_rate_hz for each in channels if each.sample_rate_hz is not None})
    longest = max(each.samples for each in channels)
    given = mapping.sample_rate_hz
    if given is None and (not said or not _same(said, longest)):
        why = "does not say its sample rate exactly" if not said else "says several sample rates"
        raise InvalidRequest(f"{path.name} {why}; give sample_rate_hz in the mapping")
    rate = given if given is not None else said[0]
    for each in channels:
        low, high = each.rates_hz
        if not agrees(rate, (low, high)):
            told = f"about {(low + high) / 2:.5g}" if each.sample_rate_hz is None else f"{low:.9g}"
            way = "export the file again" if each.sample_rate_hz is None else "leave its sample_rate_hz out"
            raise InvalidRequest(
                f"{path.name} says {told} samples/s, and the mapping {rate:.9g}; correct the mapping, "
                f"or {way}; or {_IGNORE}"
            )
        highest_hz = mapping.measurement.excitation.band_hz[1]
        if each.time_unit == "" and 2 * highest_hz > rate:
            raise InvalidRequest(
                f"the times of {path.name} have no unit; in seconds they give {rate:.6g} samples/s, too few "
                f"for the {highest_hz:g} Hz of the plan; give time_unit in the mapping"
            )
    if not _same(said, longest):
        raise InvalidRequest(
            f"{path.name} says {said[0]:.9g} and {said[-1]:.9g} samples/s for channels that belong together: "
            f"they drift apart; export them on one clock, or {_IGNORE}"
        )
    return rate


def _same(rates_hz: Sequence[float], samples: int) -> bool:
    """Tell whether channels of these rates stay together over so many samples."""
    return all(
        (high / low - 1) * samples <= _APART for low, high in pairwise((*rates_hz[:1], *rates_hz[-1:]))
    )


def _offsets(channels: Sequence[SourceChannel], rate_hz: float, path: Path) -> list[float]:
    """Return how many sample intervals after the first channel each one starts."""
    known = {each.start_s: each for each in channels if each.start_s is not None}
    if len(known) < 2 or (max(known) - min(known)) * rate_hz < _APART / 100:
        return [0.0 for _ in channels]
    unknown = [each.name for each in channels if each.start_s is None]
    if unknown:
        raise InvalidRequest(
            f"{path.name} states when some channels start, but not {', '.join(unknown)}; choose "
            f"channels of one kind, or {_IGNORE}"
        )
    if max(each.start_error_s for each in channels) * rate_hz > _APART:
        raise InvalidRequest(
            f"the channels of {path.name} start at different times, with too few digits to align them; "
            f"export them with one start, or {_IGNORE}"
        )
    return [(each.start_s - min(known)) * rate_hz for each in channels if each.start_s is not None]
