"""How large each channel of a recording was, and how much of its range it used.

What makes a channel useless for any analysis: it never moved, or it was cut off throughout.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from vibench.acquisition.recording import ChannelHeader, Recording

from ..errors import NotEnoughData, UnusableData
from ..signals import DEFAULT_BINS, Envelope, Integers, Reals
from ._channels import BASE, DRIVE, RESPONSE

_BLOCK_S = 2.0
OnRead = Callable[[int, int], None]
"""Told (samples per channel read, of how many)."""
_AT_FULL_SCALE = 0.999
"""Converters cut off a few counts to either side of their nominal range."""


@dataclass(frozen=True)
class ChannelLevel:
    """One channel over the whole recording."""

    OWN_UNITS: ClassVar = {
        "envelope": "{0.header.unit}",
        "rms": "{0.header.unit}",
        "peak": "{0.header.unit}",
        "full_scale": "{0.header.unit}",
    }

    header: ChannelHeader
    envelope: Envelope
    rms: float
    """Over the whole recording, ramps and waits included [unit of the channel]."""
    peak: float
    """Largest magnitude [unit of the channel]."""
    full_scale: float
    """Of the converter's input [unit of the channel]."""
    share_at_full_scale: float
    """Share of the samples within a thousandth of the full scale, or beyond."""

    @property
    def share_of_range(self) -> float:
        """Peak over full scale."""
        return self.peak / self.full_scale

    @property
    def span(self) -> float:
        """Largest minus smallest value; zero when the channel never moved."""
        return float(np.nanmax(self.envelope.upper) - np.nanmin(self.envelope.lower))


def ignore_reading(samples: int, of: int) -> None:
    """Watch nothing."""


def channel_levels(recording: Recording, on_read: OnRead = ignore_reading) -> tuple[ChannelLevel, ...]:
    """Go once through all samples; NotEnoughData when there are none."""
    if recording.samples == 0:
        why = f": {recording.reason}" if recording.reason else ""
        raise NotEnoughData(
            f"{recording.path.name} holds no samples ({recording.state.value}{why}); "
            "there is nothing to analyse"
        )
    length = max(1, -(-recording.samples // DEFAULT_BINS))
    block = length * max(1, round(_BLOCK_S * recording.sample_rate_hz / length))
    offset = np.array([[each.physical_offset] for each in recording.channels])
    full_scale = np.array([[abs(each.physical_per_volt) * each.range_v] for each in recording.channels])
    parts, cut = [], np.zeros(len(recording.channels), dtype=np.int64)
    for each in recording.blocks(recording.roles, block):
        parts.append(_extremes(each.values, length))
        cut += _cut_off(each.values, offset, _AT_FULL_SCALE * full_scale)
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
            rms=float(np.sqrt(np.nansum(power[row]) / recording.samples)),
            peak=float(np.nanmax(np.maximum(np.abs(lower[row]), np.abs(upper[row])))),
            full_scale=float(full_scale[row, 0]),
            share_at_full_scale=int(cut[row]) / recording.samples,
        )
        for row, header in enumerate(recording.channels)
    )


def _cut_off(values: Reals, offset: Reals, limit: Reals) -> Integers:
    """Count the samples of each channel at or beyond a limit; lost ones (NaN) are at none."""
    return np.asarray(np.count_nonzero(np.abs(values - offset) >= limit, axis=1))


def _extremes(values: Reals, length: int) -> tuple[Reals, Reals, Reals]:
    """Smallest, largest and summed squares of each bin, shape (channels, bins)."""
    starts = np.arange(0, values.shape[1], length)
    low = np.minimum.reduceat(np.nan_to_num(values, nan=np.inf), starts, axis=1)
    high = np.maximum.reduceat(np.nan_to_num(values, nan=-np.inf), starts, axis=1)
    power = np.add.reduceat(np.nan_to_num(values) ** 2, starts, axis=1)
    return np.where(np.isfinite(low), low, np.nan), np.where(np.isfinite(high), high, np.nan), power


_CLIPPED_SHARE = 0.2
"""A sine that just fills its range spends 3 % of its time within a thousandth of it; this is no sine."""


def require_moving_channels(levels: Sequence[ChannelLevel]) -> None:
    """Refuse channels that hold nothing to analyse.

    Raises
    ------
    UnusableData
        One sentence that names every such channel and what to look at.

    """
    faults = [
        each for level in levels if level.header.role in (DRIVE, BASE, RESPONSE) for each in _faults(level)
    ]
    if faults:
        raise UnusableData("; ".join(faults))


def _faults(level: ChannelLevel) -> Iterator[str]:
    role = level.header.role
    if level.span == 0:
        yield (
            f"{role} holds the same value throughout, so its sensor or its cable gave nothing; "
            "check it and measure again"
        )
    elif level.share_at_full_scale > _CLIPPED_SHARE:
        yield (
            f"{role} lay at its full scale of {level.full_scale:.3g} {level.header.unit} for "
            f"{100 * level.share_at_full_scale:.0f} % of the time, so its waveform is cut off throughout; "
            "choose a larger range or a smaller drive and measure again"
        )
