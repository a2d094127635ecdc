"""Align the channels of a file by their times; raise an error if they cannot be aligned."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import inf
from pathlib import Path

import numpy as np

from vibench.acquisition import shorten

from ..errors import InvalidRequest
from ._mapping import ImportMapping
from ._source_channel import SECONDS, SourceChannel
from ._times import TIME_UNITS, agrees

_MOST_REPEATED = 100
"""Maximum number of samples by which times may go back; after a larger jump back, another record begins."""


@dataclass(frozen=True)
class Piece:
    """Stretch of evenly spaced samples in a file."""

    first: int
    """Index of the stretch's first sample, counted from the start of the file."""
    place: int
    """Time of the stretch's first sample, in sample intervals since the channel's start."""
    samples: int

    @property
    def end(self) -> int:
        """Time one interval after the stretch's last sample, in intervals since the channel's start."""
        return self.place + self.samples

    def span(self, first: int, stop: int) -> range:
        """Return the times of the stretch's samples between ``first`` and ``stop`` in the file, if any."""
        shift = self.place - self.first
        return range(max(self.place, first + shift), min(self.end, stop + shift))


def pieces(channel: SourceChannel) -> tuple[Piece, ...]:
    """Return the parts of a channel between jumps of its times; samples at repeated times are left out.

    Raises InvalidRequest when the times go back by more than 100 samples, because two records were joined.
    """
    starts = channel.runs or ((0, 0),)
    kept: list[Piece] = []
    end = 0
    for (first, place), (stop, _) in pairwise((*starts, (channel.samples, 0))):
        back = max(0, end - place)
        if back > _MOST_REPEATED:
            raise InvalidRequest(
                f"the times of {channel.title} go back by {back} samples at sample {first}, as if two "
                'records were joined; export each record alone, or give time = "even" to ignore the times'
            )
        while back and kept and kept[-1].end > place:
            last = kept.pop()
            if last.place < place:
                kept.append(replace(last, samples=place - last.place))
        if stop - first > back:
            kept.append(Piece(first + back, place + back, stop - first - back))
        end = max(end, place + stop - first)
    return tuple(kept)


_APART = 0.1
"""Largest offset between channels that are analysed together, in sample intervals."""


@dataclass(frozen=True, eq=False)
class Alignment:
    """Positions of the samples of several channels on one even time axis."""

    rate_hz: float
    places: int
    """Length of the axis in sample intervals, from the earliest to the last sample of all channels."""
    pieces: tuple[tuple[Piece, ...], ...]
    """Evenly sampled stretches of each channel."""
    late_s: tuple[float, ...]
    """Delay that remains for each channel after rounding to whole intervals; at most half an interval."""
    errors_s: tuple[float, ...]
    """Largest error of each channel's start relative to the other channels, from the digits of the times."""
    remarks: tuple[str, ...]
    """Remarks on the times in the file, and on those times that the mapping replaces."""
    is_contradicted: bool
    """Whether the file's times, which the mapping replaces, show another sample rate or lost samples."""


def align(channels: Sequence[SourceChannel], mapping: ImportMapping, path: Path) -> Alignment:
    """Return the positions of all channels on one time axis.

    Raises InvalidRequest when the file contradicts itself or the mapping, or no common axis exists.
    """
    remarks = dict.fromkeys(_overridden(channels, mapping))
    placed = [_with_unit(each, mapping) for each in channels]
    for each in placed:
        if each.time_trouble:
            raise InvalidRequest(
                f"{path.name} {each.time_trouble} (channel {each.title}); export it again{_or_ignore(placed)}"
            )
    rate_hz = _rate_hz(placed, mapping, path)
    _require_one_shift(placed, mapping, path)
    offsets = _offsets(placed, rate_hz, path)
    errors_s = tuple(0.0 if _are_whole(offsets) else each.start_error_s for each in placed)
    cut = [
        tuple(replace(one, place=one.place + round(offset)) for one in pieces(each))
        for each, offset in zip(placed, offsets, strict=True)
    ]
    lengths = {each.samples for each in placed}
    if len(lengths) > 1 and not any(offsets) and not any(len(each.runs) > 1 for each in placed):
        counts = ", ".join(f"{each.name} {each.samples}" for each in placed)
        raise InvalidRequest(
            f"the channels of {path.name} have different numbers of samples ({counts}), but a recording "
            "needs one clock; choose channels of the same length"
        )
    places = min(each[-1].end for each in cut)
    if places <= max(each[0].place for each in cut):
        raise InvalidRequest(f"the channels of {path.name} do not overlap in time; choose channels that do")
    for each, offset, own, error_s in zip(placed, offsets, cut, errors_s, strict=True):
        if offset:
            known = f", known to within {error_s:.1g} s" if error_s else ""
            remarks[f"{each.title} starts {offset / rate_hz:.6g} s after the first channel{known}"] = None
        if len(own) > 1 or own[-1].end - own[0].place != each.samples:
            missing = own[-1].end - own[0].place - sum(one.samples for one in own)
            remarks[f"the times of {each.title} jump; {missing} samples are lost there"] = None
        low, high = each.rates_hz
        if each.time_unit is not None and (high / low - 1) * each.samples > 1:
            remarks[f"the times of {each.title} have too few digits to show every lost sample"] = None
    late_s = tuple((offset - round(offset)) / rate_hz for offset in offsets)
    is_contradicted = any(_is_contradicted(each, mapping) for each in channels)
    return Alignment(rate_hz, places, tuple(cut), late_s, errors_s, tuple(remarks), is_contradicted)


def _or_ignore(channels: Sequence[SourceChannel]) -> str:
    """Return the advice to ignore the file's times; empty if the times show lost samples."""
    if any(len(each.runs) > 1 for each in channels):
        return ""
    return ', or, if no samples are missing, give time = "even" and sample_rate_hz to ignore its times'


def _is_contradicted(channel: SourceChannel, mapping: ImportMapping) -> bool:
    if mapping.time != "even" or mapping.sample_rate_hz is None:
        return False
    stated = _with_unit(channel, mapping.model_copy(update={"time": None}))
    is_same = agrees(mapping.sample_rate_hz, stated.rates_hz)
    return not is_same or len(channel.runs) > 1 or bool(channel.time_trouble)


def _overridden(channels: Sequence[SourceChannel], mapping: ImportMapping) -> Iterator[str]:
    given = mapping.sample_rate_hz
    for each in channels:
        if mapping.time == "even":
            low, high = each.rates_hz
            rate_text = "no sample rate" if high == inf else f"{(low + high) / 2:.9g} samples/s"
            runs = f", {len(each.runs) - 1} jumps in its times" if len(each.runs) > 1 else ""
            start = f", starts at {each.start_s:.9g} s" if each.start_s else ""
            trouble = f", {each.time_trouble}" if each.time_trouble else ""
            text = f"{rate_text}{start}{runs}{trouble}"
            if _is_contradicted(each, mapping):
                text += "; if the times are right, frequencies and amplitudes are wrong"
            yield f"the mapping's {given:.9g} samples/s replace the times of the file ({text})"
        elif each.time_unit is not None and mapping.time_unit not in {None, each.time_unit}:
            text = each.time_unit or "no unit"
            yield f"times are in {mapping.time_unit} according to the mapping; the file states {text}"
        elif each.time_unit == "" and given is not None:
            unit = _with_unit(each, mapping).time_unit
            if unit:
                yield f"times without a unit are taken as {unit}, to match the mapping's sample rate"


def _with_unit(channel: SourceChannel, mapping: ImportMapping) -> SourceChannel:
    """Return a channel with times in the mapping's unit, or in a unit that fits the mapping's sample rate."""
    if mapping.time == "even":
        return SourceChannel(channel.name, channel.samples, channel.label)
    if channel.time_unit is None:
        return channel
    if mapping.time_unit is not None:
        return _in_unit(channel, mapping.time_unit)
    if channel.time_unit or mapping.sample_rate_hz is None:
        return channel
    tried = (_in_unit(channel, unit) for unit in TIME_UNITS)
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
    """Return the mapping's sample rate; if the mapping gives none, the file's sample rate."""
    rates_hz = sorted({each.sample_rate_hz for each in channels if each.sample_rate_hz is not None})
    longest = max(each.samples for each in channels)
    given = mapping.sample_rate_hz
    if given is None and (not rates_hz or not _same(rates_hz, longest)):
        why = "does not state its sample rate exactly" if not rates_hz else "states several sample rates"
        low, high = channels[0].rates_hz
        about = f" (its times give about {(low + high) / 2:.5g})" if high < inf else ""
        raise InvalidRequest(f"{path.name} {why}{about}; give sample_rate_hz in the mapping")
    rate = given if given is not None else rates_hz[0]
    for each in channels:
        low, high = each.rates_hz
        if not agrees(rate, (low, high)):
            rate_text = f"about {(low + high) / 2:.5g}" if each.sample_rate_hz is None else f"{low:.9g}"
            way = "export the file again" if each.sample_rate_hz is None else "leave its sample_rate_hz out"
            raise InvalidRequest(
                f"{path.name} states {rate_text} samples/s, but the mapping states {rate:.9g}; correct the "
                f"mapping, or {way}{_or_ignore(channels)}"
            )
        highest_hz = mapping.measurement.excitation.band_hz[1]
        if each.time_unit == "" and 2 * highest_hz > rate:
            raise InvalidRequest(
                f"the times of {path.name} have no unit; in seconds they give {rate:.6g} samples/s, too few "
                f"for the {highest_hz:g} Hz of the plan; give time_unit in the mapping"
            )
    if not _same(rates_hz, longest):
        raise InvalidRequest(
            f"{path.name} states {rates_hz[0]:.9g} and {rates_hz[-1]:.9g} samples/s for different channels, "
            f"whose times drift apart; export the channels with one clock{_or_ignore(channels)}"
        )
    return rate


def _same(rates_hz: Sequence[float], samples: int) -> bool:
    """Return whether channels with these sorted sample rates stay aligned over this number of samples."""
    return all(
        (high / low - 1) * samples <= _APART for low, high in pairwise((*rates_hz[:1], *rates_hz[-1:]))
    )


def _require_one_shift(channels: Sequence[SourceChannel], mapping: ImportMapping, path: Path) -> None:
    """Raise InvalidRequest if channels differ in facts that may shift their times in an unknown way."""
    both = zip(channels, mapping.channels, strict=True)
    unclear = [each for each, mapped in both if "delay_s" not in mapped.model_fields_set]
    for first, each in pairwise(unclear):
        if differing := sorted({*first.shifts} ^ {*each.shifts}):
            said = ", ".join(f"{name} = {shorten(value)}" for name, value in differing)
            raise InvalidRequest(
                f"{path.name} states {said} for {first.name} and {each.name}, which may shift their times; "
                f"give delay_s of both channels in the mapping{_or_ignore(channels)}"
            )


def _offsets(channels: Sequence[SourceChannel], rate_hz: float, path: Path) -> list[float]:
    """Return the start of each channel relative to the earliest channel, in sample intervals."""
    known = {each.start_s: each for each in channels if each.start_s is not None}
    unknown = [each.name for each in channels if each.start_s is None]
    # If all stated starts are zero, channels without a stated start also begin at zero.
    stated = (*known, 0.0) if unknown else tuple(known)
    if not known or (max(stated) - min(stated)) * rate_hz < _APART / 100:
        return [0.0 for _ in channels]
    if unknown:
        raise InvalidRequest(
            f"{path.name} states the start of some channels, but not of {', '.join(unknown)}; choose "
            f"only channels with a stated start, or only channels without one{_or_ignore(channels)}"
        )
    offsets = [(each.start_s - min(known)) * rate_hz for each in channels if each.start_s is not None]
    error_s = max(np.spacing(max(map(abs, known))), *(each.start_error_s for each in channels))
    if error_s * rate_hz > _APART and not _are_whole(offsets):
        raise InvalidRequest(
            f"the channels of {path.name} start at different times, which the file states with too few "
            f"digits for alignment; export the channels with the same start{_or_ignore(channels)}"
        )
    return offsets


def _are_whole(offsets: Sequence[float]) -> bool:
    """Return whether channels start whole samples apart, as with one clock; few digits then suffice."""
    return all(abs(each - round(each)) < _APART / 100 for each in offsets)
