"""Motion of shaker and specimen under a sampled voltage, at the times of its samples.

The voltage is resampled to the time steps of a `LoadedShaker`, and the motion to the voltage's sample times,
both as band-limited signals. Recordings are processed in pieces to limit memory. SI units.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray
from scipy import fft

from ..specimen.specimen import Complex, Floats, Specimen
from .loaded_shaker import Amplifier, LoadedShaker, Shaker

Singles = NDArray[np.float32]
Gain = Callable[[Floats], Complex]
"""Function that returns a sensor's complex gain at frequencies [Hz], with the shape of the argument."""

FINEST_STEP_HZ = 5e4
"""Lowest rate of steps [Hz]; the specimen's force on the table has a relative error of 5e-4 at 600 Hz."""
_PASS_PART = 0.45
"""Ratio of the pass band's end to the sample rate; a cosine edge follows, up to half the sample rate."""
_MARGIN = 2048
"""Number of samples filtered on each side of a piece; impulse responses farther away are below 1e-8."""
_PIECE = 1 << 15
"""Number of samples in a piece of the recording; each piece is filtered in one call."""
_BLOCK_S = 0.02
"""Length of the blocks at whose ends impacts are counted [s]."""


def identity(frequency_hz: Floats) -> Complex:
    """Return a gain of 1 at each frequency, shape of ``frequency_hz``."""
    return np.ones(frequency_hz.shape, dtype=np.complex128)


@dataclass(frozen=True)
class DrivenTable:
    """Model of a test bench: amplifier, shaker, specimen and sensors."""

    amplifier: Amplifier
    """Amplifier; use the default amplifier for a voltage measured at the coil."""
    shaker: Shaker
    specimen: Specimen
    base_sensor: Gain = identity
    """Complex gain of the sensor of the base acceleration."""
    m0_sensor: Gain = identity
    """Complex gain of the sensor of the m0 velocity; a delay appears as a falling phase."""
    base_low_cut_hz: float = 0.0
    """-3 dB frequency of the first-order AC coupling of the base channel [Hz]; 0 for DC coupling."""


@dataclass(frozen=True, eq=False)
class SampledMotion:
    """Outputs of the sensors, shape (samples,); single precision is far finer than converter noise."""

    base_acceleration: Singles
    """Measured base acceleration [m/s2]."""
    m0_velocity: Singles
    """Measured velocity of m0 [m/s]."""
    impact_times_s: Floats
    """Time zero and the ends of blocks of 20 ms, shape (blocks + 1,)."""
    impacts: Floats
    """Number of contacts up to each time in ``impact_times_s``, shape (blocks + 1,)."""


def follow_voltage(
    table: DrivenTable,
    volts: Floats | Singles,
    sample_rate_hz: float,
    *,
    start: ArrayLike = (0.0,) * 6,
) -> SampledMotion:
    """Return the motion of table and specimen under a sampled voltage; the table starts at rest.

    Raises MotionFailed when the motion is no longer finite.

    Parameters
    ----------
    table
        Amplifier, shaker, specimen and sensors.
    volts
        Voltage at the amplifier's input (at the coil with the default amplifier), shape (samples,) [V];
        finite, and zero at both ends.
    start
        Initial x, y, z, vx, vy, vz of the specimen in the inertial frame, shape (6,) [m, m/s].
    """
    ratio = ceil(FINEST_STEP_HZ / sample_rate_hz)
    step_s = 1 / (sample_rate_hz * ratio)
    shaken = LoadedShaker(table.amplifier, table.shaker, table.specimen, step_s, start)
    gains = (table.base_sensor, table.m0_sensor)
    kept = np.empty((len(gains), volts.size), np.float32)
    half_turn = np.tan(np.pi * table.base_low_cut_hz / sample_rate_hz)
    high_pass = [1.0, -1.0] / (1 + half_turn), [1.0, -(1 - half_turn) / (1 + half_turn)]
    memory = np.zeros(1)
    impacts = [np.zeros(1)]
    block = max(1, round(_BLOCK_S * sample_rate_hz)) * ratio
    tail = np.zeros((2, 0))
    done = 0
    resampling = _Resampling(sample_rate_hz, ratio, table.shaker)
    for stop, fine in resampling.stretches(volts):
        motion = shaken.move(fine, block=block)
        impacts.append(motion.contacts)
        tail = np.concatenate([tail, [motion.base_acceleration, motion.m0_velocity]], axis=1)
        # The filter needs the motion after the last samples, except at the end of the record.
        upto = stop if stop == volts.size else max(stop - _MARGIN, 0)
        held = stop - tail.shape[1] // ratio
        seen = resampling.samples(tail, gains)[:, done - held : upto - held]
        if half_turn > 0.0:
            seen[0], memory = scipy.signal.lfilter(*high_pass, seen[0], zi=memory)
        kept[:, done:upto] = seen
        done = upto
        tail = tail[:, max(0, (done - _MARGIN - held)) * ratio :]
    begun = np.concatenate(impacts)
    blocks_s = np.minimum(np.arange(begun.size) * (block * step_s), volts.size / sample_rate_hz)
    return SampledMotion(kept[0], kept[1], blocks_s, begun)


class _Resampling:
    """Resampling of a voltage to time steps, and of step means to the samples after sensor and converter.

    Resampled voltages refer to the start of a step, means to the centre; the two shifts cancel.
    """

    def __init__(self, sample_rate_hz: float, ratio: int, shaker: Shaker) -> None:
        self._sample_rate_hz = sample_rate_hz
        self._ratio = ratio
        self._shaker = shaker
        # Store the filter weights: all pieces of a record except the last piece have the same length.
        self._weights: dict[tuple[int, Gain | None], Floats | Complex] = {}

    def stretches(self, volts: Floats | Singles) -> Iterator[tuple[int, Floats]]:
        """Yield the end sample of each piece of the recording, and the mean voltages of the piece's steps."""
        ratio = self._ratio
        block = max(1, round(_BLOCK_S * self._sample_rate_hz))
        length = ceil(_PIECE / block) * block
        for first in range(0, volts.size, length):
            stop = min(first + length, volts.size)
            padded = np.zeros(fft.next_fast_len(stop - first + 2 * _MARGIN, real=True))
            low, high = max(first - _MARGIN, 0), min(stop + _MARGIN, volts.size)
            padded[low - first + _MARGIN : high - first + _MARGIN] = volts[low:high]
            spectrum = fft.rfft(padded) * self._weights_of(padded.size, None)
            fine = fft.irfft(spectrum, padded.size * ratio, overwrite_x=True)
            yield stop, fine[_MARGIN * ratio : (_MARGIN + stop - first) * ratio]

    def samples(self, means: Floats, gains: Sequence[Gain]) -> Floats:
        """Return the samples of each sensor from the mean inputs in each step, shape (sensors, steps)."""
        count = means.shape[1] // self._ratio
        size = int(fft.next_fast_len(count + 2 * _MARGIN, real=True))
        padded = np.zeros((len(gains), size * self._ratio))
        padded[:, _MARGIN * self._ratio : (_MARGIN + count) * self._ratio] = means
        spectrum = fft.rfft(padded, overwrite_x=True)[:, : size // 2 + 1]
        for place, gain in enumerate(gains):
            spectrum[place] *= self._weights_of(size, gain)
        return np.asarray(fft.irfft(spectrum, size, overwrite_x=True)[:, _MARGIN : _MARGIN + count])

    def _weights_of(self, size: int, gain: Gain | None) -> Floats | Complex:
        """Return the factors of spectral lines for resampling to time steps or, with ``gain``, to samples."""
        known = self._weights.get((size, gain))
        if known is None:
            frequency_hz = np.asarray(fft.rfftfreq(size, 1 / self._sample_rate_hz), dtype=np.float64)
            mean_of_step = np.sinc(frequency_hz / (self._sample_rate_hz * self._ratio)) * self._ratio
            # Band filter: gain 1 up to 0.45 cycles per sample, then a cosine edge to 0 at half a cycle.
            edge = ((frequency_hz / self._sample_rate_hz) - _PASS_PART) / (0.5 - _PASS_PART)
            band = np.asarray(0.5 * (1 + np.cos(np.pi * np.clip(edge, 0.0, 1.0))))
            if gain is None:
                known = band * mean_of_step / self._hold_gain(frequency_hz)
            else:
                known = band * gain(frequency_hz) / mean_of_step
            self._weights[size, gain] = known
        return known

    def _hold_gain(self, frequency_hz: Floats) -> Complex:
        """Return the ratio of coil currents under a stepped and a continuous voltage: 1 - (w h)^2 / 12."""
        time_constant_s = self._shaker.coil_inductance_h / self._shaker.coil_resistance_ohm
        lag = 2j * np.pi * frequency_hz * time_constant_s
        turns = self._sample_rate_hz * self._ratio * time_constant_s
        left, turned = np.exp(-1 / turns), np.exp(lag / turns)
        return np.asarray((1 + lag) * (1 - turns * (turned - 1) * (1 - left) / (turned - left)))
