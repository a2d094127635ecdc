"""Levels of a recording's channels relative to their input ranges, and refusal of unusable channels."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from vibench.acquisition.recording import ChannelHeader, Recording

from ..errors import NotEnoughData, UnusableData
from ..signals.arrays import Integers, Reals, runs_of
from ..signals.envelope import DEFAULT_BINS, Envelope
from .channels import BASE, DRIVE, OnRead, ignore_reading

_BLOCK_S = 2.0
_AT_FULL_SCALE = 0.999
"""Fraction of full scale from which a sample counts as clipped; converters clip just below full scale."""


@dataclass(frozen=True)
class ChannelLevel:
    """Level of one channel over the whole recording."""

    OWN_UNITS: ClassVar = {
        "envelope": "{0.header.unit}",
        "rms": "{0.header.unit}",
        "peak": "{0.header.unit}",
        "full_scale": "{0.header.unit}",
        "flat_tops": "{0.header.unit}",
    }

    header: ChannelHeader
    envelope: Envelope
    rms: float
    """RMS over the whole recording, including ramps and waits [unit of the channel]."""
    peak: float
    """Largest magnitude over the whole recording [unit of the channel]."""
    full_scale: float
    """Full scale of the converter's input [unit of the channel]."""
    share_at_full_scale: float
    """Fraction of the samples at or above 99.9 % of full scale."""
    flat_tops: tuple[float, ...] = ()
    """Values at which upper, lower or both peaks are clipped; empty if none are [unit of the channel]."""

    @property
    def share_of_range(self) -> float:
        """Peak of the channel divided by full scale."""
        return self.peak / self.full_scale

    @property
    def span(self) -> float:
        """Largest minus smallest value of the channel; zero if its signal is constant."""
        return float(np.nanmax(self.envelope.upper) - np.nanmin(self.envelope.lower))


def channel_levels(recording: Recording, on_read: OnRead = ignore_reading) -> tuple[ChannelLevel, ...]:
    """Return the level of each channel from all samples; raises NotEnoughData when there are none."""
    if recording.samples == 0:
        why = f": {recording.reason}" if recording.reason else ""
        raise NotEnoughData(
            f"{recording.path.name} contains no samples ({recording.state.value}{why}); "
            "there is nothing to analyse"
        )
    length = max(1, -(-recording.samples // DEFAULT_BINS))
    block = length * max(1, round(_BLOCK_S * recording.sample_rate_hz / length))
    offset = np.array([[each.physical_offset] for each in recording.channels])
    full_scale = np.array([[abs(each.physical_per_volt) * each.range_v] for each in recording.channels])
    parts, cut = [], np.zeros(len(recording.channels), dtype=np.int64)
    counts = np.zeros((len(recording.channels), _COUNTED), dtype=np.int64)
    lasting = np.zeros((len(recording.channels), 2), dtype=np.int64)
    for each in recording.blocks(recording.roles, block):
        parts.append(_extremes(each.values, length))
        # Lost samples (NaN) do not count as clipped.
        cut += np.count_nonzero(np.abs(each.values - offset) >= _AT_FULL_SCALE * full_scale, axis=1)
        for row, shares in enumerate((each.values - offset) / full_scale):
            bins = np.rint((np.clip(shares[np.isfinite(shares)], -1, 1) + 1) / 2 * (_COUNTED - 1))
            counts[row] += np.bincount(bins.astype(np.int64), minlength=_COUNTED)
            lasting[row] = np.maximum(lasting[row], _lasting(bins))
        on_read(each.first_sample + each.values.shape[1], recording.samples)
    lower, upper, power = (np.concatenate(each, axis=1) for each in zip(*parts, strict=True))
    if np.isnan(lower).all():
        raise NotEnoughData(f"all samples of {recording.path.name} were lost; there is nothing to analyse")
    bins = lower.shape[1]
    time_s = np.minimum((np.arange(bins) + 0.5) * length, recording.samples) / recording.sample_rate_hz
    return tuple(
        ChannelLevel(
            header=header,
            envelope=Envelope(time_s, lower[row], upper[row]),
            rms=float(np.sqrt(np.nansum(power[row]) / counts[row].sum())),
            peak=float(np.nanmax(np.maximum(np.abs(lower[row]), np.abs(upper[row])))),
            full_scale=float(full_scale[row, 0]),
            share_at_full_scale=int(cut[row]) / int(counts[row].sum()),
            flat_tops=tuple(
                value
                for side, highest in zip((1, -1), lasting[row], strict=True)
                if (top := _flat_top(counts[row, ::side], highest, header, full_scale[row, 0])) is not None
                and not _rests_at(
                    value := float(
                        offset[row, 0] + side * (2 * top / (_COUNTED - 1) - 1) * full_scale[row, 0]
                    ),
                    lower[row],
                    upper[row],
                )
            ),
        )
        for row, header in enumerate(recording.channels)
    )


_COUNTED = 2**16 + 1
"""Number of bins over the input range, used to find flat tops."""
_TOPS = (0.1, 0.03, 0.01)
"""Heights of the top parts of a peak that are examined for clipping, relative to the peak's height."""
_FLAT = 0.88
"""Minimum fraction of a clipped top's samples in its upper half; smooth peaks: 0.71, straight peaks: 0.84."""
_FLAT_VALUE = 0.4
"""In the upper half of a clipped peak, at least this fraction of the samples has the clipped value."""
_FEWEST_AT_TOP, _FEWEST_VALUES = 40, 12
_FEWEST_STEPS = 40
"""Minimum height of a peak [converter steps]: a sine of 16 steps has 0.42 of its samples at two values."""
_GAP, _GAP_IN_TOP = 0.01, 0.15
"""Largest range without values in a smooth, well sampled peak, relative to heights of peak and top."""
_AS_FREQUENT = 0.4
"""Largest number of samples at one value below a clipped peak, relative to the number of clipped samples."""


def _lasting(bins: Reals) -> tuple[int, int]:
    """Return the highest bin that three successive samples reach, in the signal and in its mirror image."""
    if bins.size < 3:
        return 0, 0
    three = np.stack((bins[:-2], bins[1:-1], bins[2:]))
    return int(three.min(axis=0).max()), int(_COUNTED - 1 - three.max(axis=0).min())


def _flat_top(counts: Integers, lasting: int, header: ChannelHeader, full_scale: float) -> int | None:
    """Return the value at which the upper peaks are clipped; None if they are not, or if this is unclear.

    If the sample clock is locked to the drive, every period has the same few values. The histogram of a
    smooth peak may then look clipped, but has an empty range above ``lasting``, the highest bin that three
    successive samples reach.
    """
    filled = np.flatnonzero(counts)
    if filled.size < 2:
        return None
    total = np.cumsum(counts)
    top, middle = int(filled[-1]), int(np.searchsorted(total, total[-1] / 2))
    height, at_top = top - middle, int(counts[top - 1 :].sum())

    def count_above(value: float) -> int:
        return int(total[-1] - total[max(0, int(value))])

    if height < _LEAST_HEIGHT * (top - filled[0]) or at_top == total[-1]:
        return None
    step = 0.0 if header.volts_per_count is None else header.volts_per_count * abs(header.physical_per_volt)
    resolution = max(1.0, step / full_scale * _COUNTED / 2)
    gap = max(0, int(np.diff(filled[filled >= lasting]).max(initial=0)) - resolution)
    if height > _FEWEST_STEPS * resolution and at_top >= max(
        _FEWEST_AT_TOP, _FLAT_VALUE * count_above(top - height / 2)
    ):
        other = int(counts[middle + 1 : top - 1].max(initial=0))
        if gap <= _GAP * height or 0 < other <= _AS_FREQUENT * at_top:
            return top
    for share in _TOPS:
        whole = count_above(top - share * height)
        values = int(np.count_nonzero(counts[int(top - share * height) :]))
        is_resolved = share * height > _FEWEST_VALUES * resolution and gap <= _GAP_IN_TOP * share * height
        is_counted = whole >= _FEWEST_AT_TOP and values >= _FEWEST_VALUES
        if is_resolved and is_counted and count_above(top - share * height / 2) > _FLAT * whole:
            return top
    return None


def _rests_at(value: float, lower: Reals, upper: Reals) -> bool:
    """Return whether an envelope stays near a value for long, as that of a free body before a hit does.

    If a signal has only one value, it counts as rest only at zero: a saturated amplifier is also constant.
    """
    is_near = np.maximum(abs(lower - value), abs(upper - value)) < _REST[0] * np.nanmax(
        upper - np.nanmin(lower)
    )
    is_constant = (lower == upper) & (upper != 0)
    if not np.any(is_constant & ~is_near):
        is_near &= ~is_constant
    longest = np.diff(runs_of(is_near), axis=1).max(initial=0)
    return bool(longest >= _REST[1] * lower.size)


_REST = 0.05, 0.02
"""Range of values at rest, relative to the signal's span; shortest rest, relative to the recording."""
_LEAST_HEIGHT = 0.1
"""Smallest height of a peak above the median, relative to the span; a lower top is a signal at rest."""


def _extremes(values: Reals, length: int) -> tuple[Reals, Reals, Reals]:
    """Return the minimum, maximum and sum of squares of each bin, shape (channels, bins)."""
    starts = np.arange(0, values.shape[1], length)
    low = np.minimum.reduceat(np.nan_to_num(values, nan=np.inf), starts, axis=1)
    high = np.maximum.reduceat(np.nan_to_num(values, nan=-np.inf), starts, axis=1)
    power = np.add.reduceat(np.nan_to_num(values) ** 2, starts, axis=1)
    return np.where(np.isfinite(low), low, np.nan), np.where(np.isfinite(high), high, np.nan), power


_CLIPPED_SHARE = 0.2
"""Largest fraction of samples at full scale in a usable channel; a sine just up to full scale has 3 %."""


def require_moving_channels(levels: Sequence[ChannelLevel], response: str) -> None:
    """Refuse unusable channels; ``response`` is the analysed channel.

    Raises UnusableData with one sentence that names every unusable channel and says what to check.
    """
    used = (DRIVE, BASE, response)
    faults = [each for level in levels if level.header.role in used for each in _faults(level)]
    if faults:
        raise UnusableData("; ".join(faults))


def _faults(level: ChannelLevel) -> Iterator[str]:
    role = level.header.role
    if level.span == 0:
        yield (
            f"all samples of {role} have the same value, so its sensor or its cable gave no signal; "
            "check both and measure again"
        )
    elif level.share_at_full_scale > _CLIPPED_SHARE:
        yield (
            f"{role} was at its full scale of {level.full_scale:.3g} {level.header.unit} for "
            f"{100 * level.share_at_full_scale:.0f} % of the time, so its waveform is clipped; "
            "choose a larger range or a smaller drive and measure again"
        )
