"""How much noise the channels of a recording carry: what tells two runs of one linear motion apart."""

from dataclasses import dataclass

import numpy as np

from vibench.acquisition.recording import Recording

from ..signals.arrays import Reals

_BLOCK_S = 0.05
_BLOCKS = 200
"""Looked at, evenly over the recording; the whole first and last second besides."""
_BAND = (0.2, 0.4)
"""Part of the sample rate that shows a channel's own noise: no mode reaches there, and only impacts do."""
_ALIKE = 6.0
"""Standard deviations of a block's power, of so many lines, between blocks of one level."""


@dataclass(frozen=True)
class ChannelNoise:
    """White noise of each channel, rms per sample in its physical unit."""

    rms: dict[str, float]
    converter_v: float
    """The least of them at a converter's input: the converter's own [V]."""


def channel_noise(recording: Recording, roles: tuple[str, ...]) -> ChannelNoise:
    """Take the quietest stretch of each channel: recordings begin in silence, or nearly."""
    rate, samples = recording.sample_rate_hz, recording.samples
    length = max(16, round(_BLOCK_S * rate))
    ends = np.concatenate([np.arange(0, rate, length), samples - np.arange(length, rate + length, length)])
    starts = np.unique(np.concatenate([ends, np.linspace(0, samples - length, _BLOCKS)]).astype(int))
    starts = starts[(starts >= 0) & (starts <= samples - length)]
    rms = {
        role: _quiet([_white(recording.read(role, int(at), int(at) + length)) for at in starts], length)
        for role in roles
    }
    volts = [rms[role] / abs(recording.channel(role).physical_per_volt) for role in roles]
    return ChannelNoise(rms, min(volts))


def _quiet(rms: list[float], length: int) -> float:
    """Give the level of the blocks that are as quiet as the quietest: alone it is some per cent too low."""
    if not rms:
        return 0.0
    power = np.square(rms)
    lines = (_BAND[1] - _BAND[0]) * length
    alike = power <= power.min() * (1.0 + _ALIKE / np.sqrt(lines))
    return float(np.sqrt(np.mean(power[alike]))) if np.isfinite(power.min()) else float(np.inf)


def _white(samples: Reals) -> float:
    """Rms of white noise of the density that a block shows far above all motion; infinite across a hole."""
    if np.isnan(samples).any():
        return np.inf
    power = np.abs(np.fft.rfft(samples * np.hanning(samples.size))) ** 2
    low, high = (round(part * samples.size) for part in _BAND)
    # The mean power of a bin is the variance times the sum of the squared taper.
    return float(np.sqrt(np.mean(power[low:high]) / np.sum(np.hanning(samples.size) ** 2)))
