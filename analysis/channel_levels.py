"""How large each channel of a recording was, and how much of its range it used."""

from dataclasses import dataclass

import numpy as np

from acquisition.recording import ChannelHeader, Recording

from .arrays import Reals
from .envelope import DEFAULT_BINS, Envelope
from .errors import NotEnoughData

_BLOCK_S = 2.0


@dataclass(frozen=True)
class ChannelLevel:
    """One channel over the whole recording."""

    header: ChannelHeader
    envelope: Envelope
    rms: float
    """Over the whole recording, ramps and waits included [unit of the channel]."""
    peak: float
    """Largest magnitude [unit of the channel]."""
    full_scale: float
    """Of the converter's input [unit of the channel]."""

    @property
    def share_of_range(self) -> float:
        """Peak over full scale."""
        return self.peak / self.full_scale


def channel_levels(recording: Recording) -> tuple[ChannelLevel, ...]:
    """Go once through all samples; NotEnoughData when there are none."""
    if recording.samples == 0:
        raise NotEnoughData(
            f"{recording.path.name} holds no samples ({recording.state.value}: {recording.reason}); "
            "there is nothing to analyse"
        )
    length = max(1, -(-recording.samples // DEFAULT_BINS))
    block = length * max(1, round(_BLOCK_S * recording.sample_rate_hz / length))
    parts = [_extremes(each.values, length) for each in recording.blocks(recording.roles, block)]
    lower, upper, power = (np.concatenate(each, axis=1) for each in zip(*parts, strict=True))
    bins = lower.shape[1]
    time_s = np.minimum((np.arange(bins) + 0.5) * length, recording.samples) / recording.sample_rate_hz
    return tuple(
        ChannelLevel(
            header=header,
            envelope=Envelope(time_s, lower[row], upper[row]),
            rms=float(np.sqrt(np.nansum(power[row]) / recording.samples)),
            peak=float(np.nanmax(np.maximum(np.abs(lower[row]), np.abs(upper[row])))),
            full_scale=abs(header.physical_per_volt) * header.range_v,
        )
        for row, header in enumerate(recording.channels)
    )


def _extremes(values: Reals, length: int) -> tuple[Reals, Reals, Reals]:
    """Smallest, largest and summed squares of each bin, shape (channels, bins)."""
    starts = np.arange(0, values.shape[1], length)
    low = np.minimum.reduceat(np.nan_to_num(values, nan=np.inf), starts, axis=1)
    high = np.maximum.reduceat(np.nan_to_num(values, nan=-np.inf), starts, axis=1)
    power = np.add.reduceat(np.nan_to_num(values) ** 2, starts, axis=1)
    return np.where(np.isfinite(low), low, np.nan), np.where(np.isfinite(high), high, np.nan), power
