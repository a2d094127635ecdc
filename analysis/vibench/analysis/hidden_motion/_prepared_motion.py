"""Motion of base and m0 corrected for their sensors, and the noise of both channels."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from vibench.acquisition.recording import BridgedChannel, Dropout, Recording

from ..errors import NotEnoughData, UnusableData
from ..recordings.channels import BASE, RESPONSE
from ..signals.arrays import Flags, Reals, Samples
from ._sensor_correction import HALF_LENGTH, SensorCorrection, ideal_sensors, sensor_correction

_QUIET_BANDS = ((0.36, 0.40), (0.40, 0.44))
"""Bands, relative to the sample rate, that lie in the converter's pass band but above any motion."""
_SEGMENT = 1024
_MOST_SEGMENTS = 4096
"""Maximum number of segments for the noise estimate, spread over a long motion: 80 s at 51.2 kS/s."""
_PIECE = 1 << 19
"""Number of samples that are corrected at once."""
_LEAST_NOISE = 1e-6
"""Minimum noise of a channel relative to its signal, because the Kalman filter needs a variance."""
_MEDIAN_OF_SQUARE = float(np.log(2.0))
"""Ratio of median to mean of a periodogram line of white noise, which is exponentially distributed."""
_DARK_MARGIN = 8
"""Samples on each side of a drop-out that the correction filter mixes with the drop-out (weight > 1 %)."""
LOWEST_RATE_HZ = 10_000.0
"""Lowest sample rate [Hz] at which collisions of 0.05 ms are visible."""


@dataclass(frozen=True)
class ChannelNoise:
    """White noise of base acceleration and m0's velocity, rms per sample."""

    OWN_UNITS: ClassVar = {"acceleration": "m s-2", "velocity": "m s-1"}

    acceleration: float
    """Noise of the base acceleration [m/s2]."""
    velocity: float
    """Noise of m0's velocity [m/s]."""


@dataclass(frozen=True, eq=False)
class PreparedMotion:
    """Part of a recording without lost samples, corrected for dynamics and delays of the sensors.

    Long parts are stored in single precision, whose error is far below sensor noise.
    """

    acceleration: Samples
    """Acceleration of the base, shape (samples,) [m/s2]; the tracker corrects its AC coupling."""
    velocity: Samples
    """Velocity of m0, shape (samples,) [m/s]; bridged in drop-outs."""
    is_dropout: Flags
    """Flags of samples in drop-outs, shape (samples,)."""
    sample_rate_hz: float
    coupling_rad_per_s: float
    first_sample: int
    """Index of the motion's first sample, counted from the start of the recording."""
    noise: ChannelNoise

    @property
    def samples(self) -> int:
        """Number of samples."""
        return self.velocity.size

    def accelerations(self, start: int, stop: int) -> Reals:
        """Return the base accelerations from sample ``start`` to before ``stop`` [m/s2]."""
        return self.acceleration[start:stop].astype(np.float64, copy=False)

    def velocities(self, start: int, stop: int) -> Reals:
        """Return m0's velocities from sample ``start`` to before ``stop`` [m/s]; NaN in drop-outs."""
        return np.where(self.is_dropout[start:stop], np.nan, self.velocity[start:stop].astype(np.float64))

    def part(self, start: int, stop: int) -> "PreparedMotion":
        """Return a part of the motion, with the noise of the whole motion."""
        return replace(
            self,
            acceleration=self.acceleration[start:stop],
            velocity=self.velocity[start:stop],
            is_dropout=self.is_dropout[start:stop],
            first_sample=self.first_sample + start,
        )


def prepared_motion(recording: Recording, start: int, stop: int) -> PreparedMotion:
    """Read both channels between two samples and correct for their sensors.

    Raises UnusableData when a channel is missing, samples were lost, or the rate is too low, and
    NotEnoughData when the stretch is empty.
    """
    rate = recording.sample_rate_hz
    require_channels(recording.path.name, recording.roles)
    _require_rate(rate)
    # The correction needs neighbours, so the first and last few samples of a recording are left out.
    start, stop = max(start, HALF_LENGTH), min(stop, recording.samples - HALF_LENGTH)
    _require_length(stop - start, rate)
    correction = sensor_correction(
        recording.bench, recording.channel(BASE), recording.channel(RESPONSE), rate
    )
    response = BridgedChannel(recording, RESPONSE)
    kept = np.empty((2, stop - start), dtype=np.float32)
    lost = 0
    for begin in range(start, stop, _PIECE):
        end = min(begin + _PIECE, stop)
        first, last = begin - HALF_LENGTH, end + HALF_LENGTH
        raw = [recording.read(BASE, first, last), response.read(first, last)]
        lost += _lost_samples(*raw)
        for row, values in zip(kept, correction.correct(*raw), strict=True):
            row[begin - start : end - start] = values[HALF_LENGTH:-HALF_LENGTH]
    _require_finite(lost)
    dropouts = response.between(start - _DARK_MARGIN, stop + _DARK_MARGIN)
    return _motion(kept, dropout_samples(dropouts, start, stop), rate, correction, start)


def dropout_samples(dropouts: Sequence[Dropout], start: int, stop: int) -> Flags:
    """Return flags of the corrected samples from ``start`` to before ``stop`` that drop-outs affect."""
    is_dropout = np.zeros(stop - start, dtype=np.bool_)
    for each in dropouts:
        first, behind = each.first - _DARK_MARGIN - start, each.stop + _DARK_MARGIN - start
        is_dropout[max(first, 0) : max(behind, 0)] = True
    return is_dropout


def _motion(
    corrected: Samples,
    is_dropout: Flags,
    sample_rate_hz: float,
    correction: SensorCorrection,
    first_sample: int,
) -> PreparedMotion:
    noise = ChannelNoise(*(white_noise(each) for each in corrected))
    return PreparedMotion(
        corrected[0],
        corrected[1],
        is_dropout,
        sample_rate_hz,
        correction.coupling_rad_per_s,
        first_sample,
        noise,
    )


def motion_in_samples(acceleration: Reals, velocity: Reals, sample_rate_hz: float) -> PreparedMotion:
    """Return the motion of samples already corrected for their sensors; raises like `prepared_motion`."""
    _require_rate(sample_rate_hz)
    _require_length(velocity.size - 2 * HALF_LENGTH, sample_rate_hz)
    _require_finite(_lost_samples(acceleration, velocity))
    correction = ideal_sensors(sample_rate_hz)
    corrected = np.array(correction.correct(acceleration, velocity))[:, HALF_LENGTH:-HALF_LENGTH]
    light = np.zeros(corrected.shape[1], dtype=np.bool_)
    return _motion(corrected, light, sample_rate_hz, correction, HALF_LENGTH)


def _require_rate(sample_rate_hz: float) -> None:
    if not sample_rate_hz >= LOWEST_RATE_HZ:
        raise UnusableData(
            f"the motion was sampled at {sample_rate_hz:g} Hz, but impacts are visible only from "
            f"{LOWEST_RATE_HZ:g} Hz on; measure at a higher rate to track the hidden motion"
        )


def _require_length(samples: int, sample_rate_hz: float) -> None:
    if samples < _SEGMENT:
        raise NotEnoughData(
            f"{max(samples, 0) / sample_rate_hz:.3g} s is too short to track the hidden motion; "
            f"{_SEGMENT / sample_rate_hz:.2g} s are needed"
        )


def _lost_samples(acceleration: Reals, velocity: Reals) -> int:
    return int(np.count_nonzero(~np.isfinite(acceleration) | ~np.isfinite(velocity)))


def _require_finite(lost: int) -> None:
    if lost:
        raise UnusableData(
            f"{lost} samples were lost or are not finite, but motion can be tracked only without gaps in "
            "the samples; choose a part without lost samples, or measure again"
        )


def require_channels(name: str, roles: Collection[str]) -> None:
    """Raise UnusableData if a recording, or a bench, lacks a channel that hidden motion needs."""
    missing = [role for role in (BASE, RESPONSE) if role not in roles]
    if missing:
        raise UnusableData(
            f"{name} has no channel {' and no channel '.join(missing)}; hidden motion needs {BASE} and "
            f"{RESPONSE} with white noise: measure m0 with a vibrometer"
        )


def white_noise(samples: Samples) -> float:
    """Estimate the rms of white noise in the quieter of two high-frequency bands; medians reject impacts."""
    count = samples.size // _SEGMENT
    every = -(-count // _MOST_SEGMENTS)
    pieces = samples[: count * _SEGMENT].reshape(count, _SEGMENT)[::every] * np.hanning(_SEGMENT)
    power = np.abs(np.fft.rfft(pieces, axis=1)) ** 2 / np.sum(np.hanning(_SEGMENT) ** 2)
    cycles = np.fft.rfftfreq(_SEGMENT)
    levels = [
        np.median(power[:, (cycles >= low) & (cycles < high)]) / _MEDIAN_OF_SQUARE
        for low, high in _QUIET_BANDS
    ]
    return float(np.sqrt(max(min(levels), _LEAST_NOISE**2 * float(np.mean(pieces**2)), np.finfo(float).tiny)))
