"""Peaks of an amplitude spectrum, placed between its lines."""

from dataclasses import dataclass

import numpy as np
import scipy

from ..errors import InvalidRequest
from ..signals.arrays import Reals
from ..signals.window import Window
from ..spectra.spectra import AmplitudeSpectrum

_NOISE_NEIGHBOURS = 50
"""Lines on either side whose median is taken as the floor around a peak."""
_LEAST_RATIO = 5.0
"""A peak stands at least so many times above that floor."""
_MEDIAN_OF_RAYLEIGH = float(np.sqrt(2 * np.log(2)))
"""Median of the magnitude of complex noise, in standard deviations of one component."""


@dataclass(frozen=True)
class Peak:
    """A line of a spectrum that stands above its neighbourhood."""

    frequency_hz: float
    sd_frequency_hz: float
    """From the noise around it; zero neighbourhood gives zero."""
    amplitude: float
    """Peak amplitude, corrected for lying between lines [unit of the spectrum]."""
    floor: float
    """Median amplitude of the lines around it [unit of the spectrum]."""


def peaks(spectrum: AmplitudeSpectrum, *, low_hz: float, high_hz: float, count: int) -> tuple[Peak, ...]:
    """Find the largest peaks of a Hann spectrum in a band, the largest first.

    For a sine between two lines the ratio of the two largest Hann values gives the place exactly
    (Grandke 1983, IEEE Trans. Instrum. Meas. 32, 350-355): d = (2a - 1) / (a + 1), and the amplitude is
    the reading times (pi d / sin(pi d)) (1 - d^2).

    Parameters
    ----------
    low_hz, high_hz
        Where to look; both at least two lines away from 0 and from half the sample rate.
    count
        At most so many.

    """
    if spectrum.window is not Window.HANN:
        raise InvalidRequest(f"peaks are placed in Hann spectra only; this one is {spectrum.window.value}")
    amplitude = spectrum.amplitude
    first = max(2, int(np.ceil(low_hz / spectrum.spacing_hz)))
    last = min(amplitude.size - 3, int(np.floor(high_hz / spectrum.spacing_hz)))
    if last < first:
        raise InvalidRequest(
            f"no line lies between {low_hz:g} and {high_hz:g} Hz; they are {spectrum.spacing_hz:g} Hz apart"
        )
    found = scipy.signal.find_peaks(amplitude[first - 1 : last + 2])[0] + first - 1
    found = found[(found >= first) & (found <= last)]
    placed = [_placed(spectrum, amplitude, int(line)) for line in found[np.argsort(-amplitude[found])]]
    return tuple(peak for peak in placed if peak.amplitude > _LEAST_RATIO * peak.floor)[:count]


def _placed(spectrum: AmplitudeSpectrum, amplitude: Reals, line: int) -> Peak:
    side = 1 if amplitude[line + 1] >= amplitude[line - 1] else -1
    ratio = amplitude[line + side] / amplitude[line]
    offset = (2 * ratio - 1) / (ratio + 1)
    around = np.concatenate(
        (
            amplitude[max(1, line - _NOISE_NEIGHBOURS) : max(1, line - 3)],
            amplitude[line + 4 : line + 1 + _NOISE_NEIGHBOURS],
        )
    )
    floor = float(np.median(around)) if around.size else 0.0
    # dd/da = 3 / (a + 1)^2; the noises of neighbouring Hann lines are correlated by 2/3.
    sd_ratio = floor / _MEDIAN_OF_RAYLEIGH / amplitude[line] * np.sqrt(1 + ratio**2 - 4 / 3 * ratio)
    return Peak(
        frequency_hz=float((line + side * offset) * spectrum.spacing_hz),
        sd_frequency_hz=float(3 / (ratio + 1) ** 2 * sd_ratio * spectrum.spacing_hz),
        amplitude=float(amplitude[line] / np.sinc(offset) * (1 - offset**2)),
        floor=floor,
    )
