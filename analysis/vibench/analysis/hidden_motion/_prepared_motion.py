"""Motion of base and m0, corrected for their sensors by short filters, and the noise of both channels."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, ClassVar

import numpy as np

from vibench.acquisition.recording import BridgedChannel, Dropout, Recording, coupling_cut_hz

from ..errors import NotEnoughData, UnusableData
from ..recordings.channels import BASE, RESPONSE, SensedChannel, sensor_gain
from ..signals import Complexes, Flags, Reals, Samples

HALF_LENGTH = 16
"""Samples on each side that a corrected sample needs: a third of a millisecond at 51.2 kS/s."""
_EXACT_BAND = 0.42
"""Fraction of the sample rate up to which the correction is fitted; converters pass up to 0.45."""
_FIT_POINTS = 400
_REST_WEIGHT = 1e-3
"""Weight of the fit above the correction's band; this weight only limits the gain above the band."""


@dataclass(frozen=True, eq=False)
class SensorCorrection:
    """Filters for both channels, and the AC coupling for the tracker."""

    acceleration: Reals
    """Filter weights, shape (2 HALF_LENGTH + 1,); they also correct for linear interpolation."""
    velocity: Reals
    coupling_rad_per_s: float
    """Corner of the accelerometer's AC coupling, which the tracker corrects; 0 for DC."""

    def correct(self, acceleration: Reals, velocity: Reals) -> tuple[Reals, Reals]:
        """Return the motion of base and m0; values within HALF_LENGTH samples of an end are wrong."""
        return (
            np.convolve(acceleration, self.acceleration, "same"),
            np.convolve(velocity, self.velocity, "same"),
        )


def sensor_correction(
    bench: Mapping[str, Any], base: SensedChannel, response: SensedChannel, sample_rate_hz: float
) -> SensorCorrection:
    """Design the filters from a recording's sensors; undescribed sensors are assumed ideal."""

    def base_gain(frequency_hz: Reals) -> Complexes:
        interpolation = np.sinc(frequency_hz / sample_rate_hz) ** 2
        return np.asarray(sensor_gain(bench, base, frequency_hz) * interpolation)

    return SensorCorrection(
        acceleration=_inverse(base_gain, sample_rate_hz),
        velocity=_inverse(partial(sensor_gain, bench, response), sample_rate_hz),
        coupling_rad_per_s=2.0 * np.pi * coupling_cut_hz(base.coupling),
    )


def _inverse(sensor: Callable[[Reals], Complexes | Reals], sample_rate_hz: float) -> Reals:
    """Return weights whose response is the inverse of a sensor's, by least squares over the band."""
    cycles = np.linspace(0.0, 0.5, _FIT_POINTS)
    inside = cycles <= _EXACT_BAND
    target = np.where(inside, 1.0 / sensor(cycles * sample_rate_hz), 0.0)
    lags = np.arange(-HALF_LENGTH, HALF_LENGTH + 1)
    matrix = np.exp(-2j * np.pi * cycles[:, np.newaxis] * lags)
    weight = np.where(inside, 1.0, _REST_WEIGHT)[:, np.newaxis]
    rows = np.concatenate([(matrix * weight).real, (matrix * weight).imag])
    aims = target * weight[:, 0]
    weights, *_ = np.linalg.lstsq(rows, np.concatenate([aims.real, aims.imag]))
    return np.asarray(weights / weights.sum())


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
    """Acceleration of the base, shape (samples,) [m/s2]; the tracker corrects the sensor's AC coupling."""
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
    # The correction needs neighbouring samples, so leave out the first and last samples of the recording.
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
    """Return, for the samples from ``start`` to before ``stop``, flags of those that drop-outs affect."""
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
    """Return the motion of samples already corrected for their sensors; raises as `prepared_motion` does."""
    _require_rate(sample_rate_hz)
    _require_length(velocity.size - 2 * HALF_LENGTH, sample_rate_hz)
    _require_finite(_lost_samples(acceleration, velocity))
    # Correct only for the linear interpolation between samples.
    only = np.zeros(2 * HALF_LENGTH + 1)
    only[HALF_LENGTH] = 1.0
    interpolation = _inverse(lambda hz: np.sinc(hz / sample_rate_hz) ** 2, sample_rate_hz)
    correction = SensorCorrection(interpolation, only, 0.0)
    corrected = np.array(correction.correct(acceleration, velocity))[:, HALF_LENGTH:-HALF_LENGTH]
    light = np.zeros(corrected.shape[1], dtype=np.bool_)
    return _motion(corrected, light, sample_rate_hz, correction, HALF_LENGTH)


def _require_rate(sample_rate_hz: float) -> None:
    if not sample_rate_hz >= LOWEST_RATE_HZ:
        raise UnusableData(
            f"the motion was sampled at {sample_rate_hz:g} Hz, but impacts are visible only at "
            f"{LOWEST_RATE_HZ:g} Hz or more; measure at a higher rate to track the hidden motion"
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
    """Raise UnusableData if a recording or bench does not have every channel that hidden motion needs."""
    missing = [role for role in (BASE, RESPONSE) if role not in roles]
    if missing:
        raise UnusableData(
            f"{name} has no channel {' and no channel '.join(missing)}; hidden motion needs {BASE} and "
            f"{RESPONSE} whose noise is white: measure m0 with a vibrometer"
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
