"""The phase of a recorded sine drive: the clock that a sweep and a dwell are analysed by."""

from dataclasses import dataclass

import numpy as np
from scipy import fft

from ..errors import NotEnoughData, UnusableData
from ..signals import Reals

_MARGIN = 0.5
"""Kept around the drive's band, as a fraction of its ends; the outer half is the filter's edge."""
_EDGE_CYCLES = 8
"""Cycles at the lowest frequency after which the filter's ringing is below 1e-5 of a radian."""
_LEAST_CYCLES = 10
_LEAST_SHARE = 0.5
"""Part of the channel's power that the drive's band must hold to be a drive."""


@dataclass(frozen=True)
class DrivePhase:
    """Unwrapped phase of a drive; the drive is cos(phase). Arrays of shape (samples,)."""

    phase_rad: Reals
    frequency_hz: Reals
    """Instantaneous, by the converter's clock."""
    amplitude: Reals
    """Peak amplitude of the drive channel [its unit]."""


def drive_phase(drive: Reals, sample_rate_hz: float, *, low_hz: float, high_hz: float) -> DrivePhase:
    """Measure the phase of a sine drive, steady or sweeping, from its analytic signal.

    Nothing nominal enters: 10 ppm between the clocks of generator and converter would turn the phase
    of a nominal 150 to 350 Hz sweep by 250 degrees at its end.

    Parameters
    ----------
    drive
        The recorded generator voltage, shape (samples,).
    low_hz, high_hz
        Between these the drive frequency stays; components well outside are ignored.

    """
    if drive.size < _LEAST_CYCLES * sample_rate_hz / low_hz:
        raise NotEnoughData(
            f"the drive holds {drive.size * low_hz / sample_rate_hz:.1f} cycles at {low_hz:g} Hz; "
            f"its phase needs at least {_LEAST_CYCLES}"
        )
    padded = fft.next_fast_len(drive.size)
    edge = min(int(_EDGE_CYCLES * sample_rate_hz / low_hz), drive.size // 8)
    padded = fft.next_fast_len(drive.size + edge)
    spectrum = fft.fft(drive - np.mean(drive), padded)
    band = _band(fft.fftfreq(padded, 1 / sample_rate_hz), low_hz, high_hz)
    power = np.sum(np.abs(spectrum) ** 2)
    kept = 2 * spectrum * band
    if not np.sum(np.abs(kept) ** 2) / 2 > _LEAST_SHARE * power:
        raise UnusableData(
            f"the drive channel holds no sine between {low_hz:g} and {high_hz:g} Hz; "
            "check the channel and the frequencies"
        )
    analytic = fft.ifft(kept, overwrite_x=True)[: drive.size]
    phase = _continued(np.unwrap(np.angle(analytic)), edge)
    return DrivePhase(
        phase_rad=phase,
        frequency_hz=np.gradient(phase) * (sample_rate_hz / (2 * np.pi)),
        amplitude=np.abs(analytic),
    )


def _band(frequency_hz: Reals, low_hz: float, high_hz: float) -> Reals:
    """Positive frequencies around the drive, with cosine edges: their ringing dies within a few cycles."""
    rise = (frequency_hz / low_hz - (1 - _MARGIN)) / (_MARGIN / 2)
    fall = ((1 + _MARGIN) - frequency_hz / high_hz) / (_MARGIN / 2)
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.clip(np.minimum(rise, fall), 0.0, 1.0)))


def _continued(phase: Reals, edge: int) -> Reals:
    """Replace the ends, where the filter misses past or future, by the parabola of what lies next to them."""
    if edge == 0:
        return phase
    place = np.arange(3 * edge, dtype=np.float64) / edge - 2
    result = phase.copy()
    for ends in (slice(None), slice(None, None, -1)):
        side = result[ends]
        parabola = np.polynomial.Polynomial.fit(place, side[edge : 4 * edge], 2)
        side[:edge] = parabola(np.arange(-edge, 0) / edge - 2)
    return result
