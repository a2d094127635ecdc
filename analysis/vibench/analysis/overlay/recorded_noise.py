"""Noise of a recording's channels, and of an amplifier whose output is not recorded."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from vibench.acquisition.recording import Recording

from ..recordings.channels import BASE, RecordedChannels
from ..signals.arrays import Complexes, Reals
from ..sine.dwell import silence_before
from .driven_rig import Driven, DrivenRig, acceleration_per_volt, carried_mass

_FEWEST_LINES = 50
"""Fewest lines in silence; they determine the level of noise to 25 %."""
_BLOCK_S = 0.05
_BLOCKS = 200
"""Blocks spread over the recording, in addition to the first and last second."""
_BAND = (0.2, 0.4)
"""Band relative to the sample rate that shows channel noise, without modes."""
_ALIKE = 6.0
"""Standard deviations of a block's power within which blocks have the same level."""


@dataclass(frozen=True)
class ChannelNoise:
    """White noise of each channel, rms per sample in its physical unit."""

    rms: dict[str, float]
    converter_v: float
    """Smallest noise of all converter inputs, taken as the converter's own [V]."""


def channel_noise(recording: Recording, roles: tuple[str, ...]) -> ChannelNoise:
    """Return the noise in the quietest stretch of each channel, since recordings start in silence."""
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
    """Return the mean level of the quiet blocks; the quietest one alone is some per cent too low."""
    if not rms:
        return 0.0
    power = np.square(rms)
    lines = (_BAND[1] - _BAND[0]) * length
    alike = power <= power.min() * (1.0 + _ALIKE / np.sqrt(lines))
    return float(np.sqrt(np.mean(power[alike]))) if np.isfinite(power.min()) else float(np.inf)


def _white(samples: Reals) -> float:
    """Return the rms of white noise from the density far above all motion; infinite across a hole."""
    if np.isnan(samples).any():
        return np.inf
    power = np.abs(np.fft.rfft(samples * np.hanning(samples.size))) ** 2
    low, high = (round(part * samples.size) for part in _BAND)
    # The mean power of a bin is the variance times the sum of the squared taper.
    return float(np.sqrt(np.mean(power[low:high]) / np.sum(np.hanning(samples.size) ** 2)))


_HEARD_HZ = (100.0, 2000.0)
"""Band in which noise of the drive shows in the base; above it, a table has further resonances."""
_MEDIAN_SD = 1.44
"""Relative standard deviation of the median of N exponential values, times the root of N."""
_HANN_LINES = 1.5
"""Lines of a Hann-windowed spectrum per independent line."""
UNKNOWN_NOISE = (
    "The noise of the amplifier is unknown, because neither its voltage nor the silence of a bench check was "
    "recorded; limits of a weak motion may be too narrow"
)


@dataclass(frozen=True)
class UnseenNoise:
    """White noise that moves the table and is missing in the drive's channel, referred to that channel."""

    power: float = 0.0
    """Variance per sample [V²]."""
    sd: float = 0.0
    """Standard deviation of this power [V²]."""

    def drawn(self, rng: np.random.Generator) -> float:
        """Return a possible rms per sample [V]."""
        return float(np.sqrt(max(0.0, self.power + self.sd * rng.standard_normal()))) if self.sd else 0.0


def unseen_noise(
    channels: RecordedChannels, rig: DrivenRig, noise: ChannelNoise
) -> tuple[UnseenNoise, ChannelNoise] | None:
    """Return the noise of an amplifier whose output is not recorded; None if no silence shows it.

    In silence, the motion under the recorded voltage is subtracted from the recorded base motion. The rest is
    noise of amplifier, converter and sensor. The median over lines ignores hum. The second result is the
    channels' noise without that of the amplifier.
    """
    if rig.driven is Driven.AMPLIFIER:
        return UnseenNoise(), noise
    volts, base, _ = silence_before(channels)
    cycles = np.fft.rfftfreq(max(volts.size, 1))
    frequency_hz: Reals = np.asarray(cycles * channels.sample_rate_hz, dtype=np.float64)
    inside = (frequency_hz >= _HEARD_HZ[0]) & (frequency_hz <= _HEARD_HZ[1]) & (cycles < _BAND[1])
    lines = int(np.sum(inside))
    if lines < _FEWEST_LINES:
        return None
    gain, taper = _base_over_voltage(rig, frequency_hz), np.hanning(volts.size)
    seen_v, seen = (np.fft.rfft((each - each.mean()) * taper) for each in (volts, base))
    power = np.abs(seen - gain * seen_v)[inside] ** 2 / np.sum(taper**2)
    passed = np.abs(gain[inside]) ** 2
    passed_high = float(np.mean(np.abs(gain[(cycles >= _BAND[0]) & (cycles < _BAND[1])]) ** 2))
    physical_per_volt = {role: abs(channels.recording.channel(role).physical_per_volt) for role in noise.rms}
    own_v2 = (noise.converter_v * physical_per_volt[rig.role]) ** 2
    recorded_v2 = noise.rms[rig.role] ** 2 - own_v2
    floor = (noise.converter_v * physical_per_volt[BASE]) ** 2

    def sensor(unseen_v2: float) -> float:
        """Return the variance of the base's sensor noise, from the high band [m²/s⁴]."""
        return max(floor, noise.rms[BASE] ** 2 - passed_high * (recorded_v2 + unseen_v2))

    def excess(unseen_v2: float) -> float:
        """Return the median of power over level, minus log 2: for the true noise, this is 0."""
        level = passed * (unseen_v2 + own_v2) + sensor(unseen_v2)
        return float(np.median(power / level) - np.log(2.0))

    most = float(np.max(power / passed)) / np.log(2.0)
    found = float(brentq(excess, 0.0, most)) if excess(0.0) > 0.0 > excess(most) else 0.0
    rest = sensor(found)
    sd = _MEDIAN_SD * np.sqrt(_HANN_LINES / lines) * (found + own_v2 + rest / float(np.median(passed)))
    without = replace(noise, rms={**noise.rms, BASE: float(np.sqrt(rest))})
    return UnseenNoise(found, float(sd)), without


def _base_over_voltage(rig: DrivenRig, frequency_hz: Reals) -> Complexes:
    """Return the recorded base acceleration per recorded voltage; 0 at 0 Hz."""
    table, above = rig.table, frequency_hz[1:]
    s: Complexes = np.asarray(2j * np.pi * above, dtype=np.complex128)
    moved = acceleration_per_volt(table.shaker, s, carried_mass(table.specimen, above))
    return np.concatenate(([0.0], table.amplifier.gain * table.base_sensor(above) * moved))
