"""Compare measurements and predictions as curves over frequency.

A curve is the ratio of m0's displacement to the base displacement over frequency [Hz], with its relative
standard deviation. It shows a measured, simulated or predicted transmission, Response I or Response II. The
package also finds peaks, values at markers, and differences of curves.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
import scipy

from .errors import NotEnoughData
from .frequency_response.noise_response import NoiseResponse
from .live import column_starts, envelope
from .overlay.ensemble import CurveDifference, logarithmic_difference
from .overlay.overlay import ResponsePrediction
from .signals import PER_NEPER_DB, Reals
from .sine.dwell import DwellResponse
from .sine.stepped_response import SteppedResponse
from .sine.sweep import SweptMotion
from .tables import Tabular


class CurveOrigin(StrEnum):
    """Origin of a curve, such as measured, simulated or predicted."""

    MEASURED = "measured"
    SIMULATED = "simulated"
    """Simulation driven by the recorded voltage or base motion, analysed with the same estimator."""
    PREDICTED = "predicted"
    """Predicted response of the specimen when driven by sines."""
    STABLE = "stable branches"
    """Stable periodic motions on branches; there may be several at one frequency."""
    UNSTABLE = "unstable branches"
    """Unstable periodic motions on branches; there may be several at one frequency."""
    UNDECIDED = "branches of undecided stability"
    """Periodic motions whose largest Floquet multiplier has the magnitude 1 within its error."""


class CurveKind(StrEnum):
    """Quantity that a curve shows."""

    TRANSMISSIBILITY = "transmission"
    RESPONSE_I = "Response I"
    RESPONSE_II = "Response II"


@dataclass(frozen=True, eq=False)
class Curve(Tabular):
    """One curve; arrays of shape (points,), with ascending frequencies except on branches."""

    source: str
    """Name of the recording or of the prediction."""
    origin: CurveOrigin
    response: CurveKind
    frequency_hz: Reals
    magnitude: Reals
    """Displacement of m0 over displacement of the base; NaN where missing."""
    relative_sd: Reals
    """Relative standard deviation of the magnitude; NaN if unknown."""
    note: str = ""
    """Remarks on the curve, such as averages, window and accuracy."""
    level_m: float | None = None
    """Base amplitude of a simulated curve [m]; None if no amplitude was requested."""

    @property
    def name(self) -> str:
        """Name with quantity and origin, such as ``"sweep_weak, Response II, measured"``."""
        return f"{self.source}, {self.response.value}, {self.origin.value}"

    @property
    def is_single_valued(self) -> bool:
        """Whether each frequency has one value; branches may have several."""
        return self.origin not in (CurveOrigin.STABLE, CurveOrigin.UNSTABLE, CurveOrigin.UNDECIDED)

    @property
    def lower(self) -> Reals:
        """Lower bound: ln(magnitude) less two standard deviations, but at least a tenth of the magnitude."""
        return np.asarray(self.magnitude * np.exp(-self._reach))

    @property
    def upper(self) -> Reals:
        """Upper bound: ln(magnitude) plus two standard deviations, but at most ten times the magnitude."""
        return np.asarray(self.magnitude * np.exp(self._reach))

    def band(self, columns: int) -> tuple[Reals, Reals, Reals]:
        """Return frequencies and bounds at up to ``columns`` points, because drawing filled areas is slow."""
        starts = column_starts(self.frequency_hz.size, columns)
        low, _ = envelope(self.lower, columns)
        _, high = envelope(self.upper, columns)
        return self.frequency_hz[starts], np.asarray(low, np.float64), np.asarray(high, np.float64)

    @property
    def _reach(self) -> Reals:
        """Half width of the bounds of ln(magnitude), at most ln 10: wide bounds would fill the figure."""
        return np.minimum(2 * self.relative_sd, np.log(10.0))

    def at(self, frequency_hz: Reals) -> "Curve":
        """Return the curve interpolated on logarithmic axes; NaN outside its range, and for branches."""
        known = np.isfinite(self.magnitude) & (self.magnitude > 0)
        if not known.any() or not self.is_single_valued:
            return replace(
                self,
                frequency_hz=frequency_hz,
                magnitude=np.full(frequency_hz.shape, np.nan),
                relative_sd=np.full(frequency_hz.shape, np.nan),
            )
        place, given = np.log(frequency_hz), np.log(self.frequency_hz[known])
        magnitude = np.interp(place, given, np.log(self.magnitude[known]), left=np.nan, right=np.nan)
        spread = np.interp(place, given, self.relative_sd[known], left=np.nan, right=np.nan)
        return replace(self, frequency_hz=frequency_hz, magnitude=np.exp(magnitude), relative_sd=spread)


def sorted_curve(curve: Curve) -> Curve:
    """Return the curve sorted by frequency, without duplicates: sweeps may go down, and points may repeat."""
    frequency_hz, first = np.unique(curve.frequency_hz, return_index=True)
    return replace(
        curve,
        frequency_hz=frequency_hz,
        magnitude=curve.magnitude[first],
        relative_sd=curve.relative_sd[first],
    )


def curve_difference(curve: Curve, reference: Curve) -> CurveDifference:
    """Return the ratio of two curves at the frequencies of the first, within their common range.

    Raises NotEnoughData when the curves have no frequency in common, or one of them is a branch.
    """
    for each in (curve, reference):
        if not each.is_single_valued:
            raise NotEnoughData(
                f"{each.name} has several values at one frequency, so a difference is not defined; "
                "compare curves of recordings or predictions"
            )
    other = reference.at(curve.frequency_hz)
    shared = np.isfinite(curve.magnitude) & np.isfinite(other.magnitude)
    if not shared.any():
        raise NotEnoughData(
            f"{curve.name} and {reference.name} have no frequency in common; compare curves that overlap"
        )
    return logarithmic_difference(
        curve.frequency_hz[shared],
        *((each.magnitude[shared], np.nan_to_num(each.relative_sd[shared])) for each in (curve, other)),
    )


@dataclass(frozen=True)
class Reading:
    """Values of one curve at the markers' frequencies."""

    name: str
    magnitudes: tuple[float, ...]
    """Value of the curve at each marker; NaN outside the frequency range of the curve."""
    decibel: float
    """Ratio of the value at the last marker to that at the first marker [dB]; NaN if either is missing."""


def readings(curves: Sequence[Curve], frequencies_hz: Sequence[float]) -> tuple[Reading, ...]:
    """Return the values of every curve at the frequencies of the markers [Hz]."""
    at_hz, found = np.asarray(frequencies_hz, dtype=np.float64), []
    for curve in curves:
        values = curve.at(at_hz).magnitude
        ratio = float(20 * np.log10(values[-1] / values[0])) if values.size else float("nan")
        found.append(Reading(curve.name, tuple(values.tolist()), ratio))
    return tuple(found)


_LEAST_RISE_DB = 3.0
"""Minimum height of a peak above the neighbouring valley [dB]."""
_LEAST_RISE_SD = 8.0
"""Minimum height of a peak [standard deviations]; a thousand points of noise span 6.5 standard deviations."""
_CROWDS = ((1, 5.0), (2, 13.0), (3, 24.0))
"""Pairs (n, distance [half widths]): a mode has at most n peaks, including its own, within this distance."""
_CROWD_RISE = 0.3
"""Minimum height of a peak that is counted for `_CROWDS`, relative to the minimum height of a mode's peak."""
_USUAL_HALF_WIDTH = 0.01
"""Relative half width assumed for a peak that does not fall by 3 dB on both sides."""
_HALF_POWER = 1 / np.sqrt(2)


@dataclass(frozen=True)
class CurvePeak:
    """Resonance peak of a curve."""

    frequency_hz: float
    """Vertex of a parabola through the highest point and its neighbours, on logarithmic axes."""
    magnitude: float
    relative_sd: float
    """Relative standard deviation of the magnitude; NaN if unknown."""
    half_power_width_hz: float | None
    """Width at half power; None if the curve ends or exceeds the peak before falling to half power."""

    @property
    def damping_ratio(self) -> float | None:
        """Half the width divided by the peak's frequency: the damping ratio of a single linear mode."""
        width_hz = self.half_power_width_hz
        return None if width_hz is None else 0.5 * width_hz / self.frequency_hz


def curve_peaks(curve: Curve, most: int = 6) -> tuple[CurvePeak, ...]:
    """Return the highest resonance peaks, sorted by frequency.

    Branches and chaotic parts of a curve have no peaks.

    Parameters
    ----------
    curve
        Measured or predicted curve.
    most
        Maximum number of peaks.
    """
    known = np.isfinite(curve.magnitude) & (curve.magnitude > 0)
    frequency_hz, height = curve.frequency_hz[known], np.log(curve.magnitude[known])
    if height.size < 3 or not curve.is_single_valued:
        return ()
    spread = np.nan_to_num(curve.relative_sd[known])
    least = _LEAST_RISE_DB / PER_NEPER_DB
    places, found = scipy.signal.find_peaks(height, prominence=_CROWD_RISE * least)
    rise = found["prominences"] / np.maximum(least, _LEAST_RISE_SD * spread[places])
    others_hz = frequency_hz[places[rise > _CROWD_RISE]]
    clear = places[rise > 1.0]
    peaks: list[CurvePeak] = []
    for place in clear[np.argsort(-height[clear])]:
        if len(peaks) == most:
            break
        peak, half_width_hz = _peak(frequency_hz, height, curve.relative_sd[known], int(place))
        away = np.abs(others_hz - peak.frequency_hz) / half_width_hz
        # The count includes the peak itself.
        if all(np.count_nonzero(away < reach) <= count for count, reach in _CROWDS):
            peaks.append(peak)
    return tuple(sorted(peaks, key=lambda each: each.frequency_hz))


def _peak(frequency_hz: Reals, height: Reals, spread: Reals, place: int) -> tuple[CurvePeak, float]:
    """Return a peak, and the larger of its two half widths [Hz]."""
    x, y = np.log(frequency_hz[place - 1 : place + 2]), height[place - 1 : place + 2]
    # Use divided differences, which are fast: a chaotic curve has thousands of peaks.
    (left, right), (before, after) = np.diff(y) / np.diff(x), np.diff(x)
    bend, top = (right - left) / (before + after), y[1]
    slope = (left * after + right * before) / (before + after)
    offset = float(np.clip(-slope / (2 * bend), x[0] - x[1], x[2] - x[1])) if bend < 0 else 0.0
    peak = float(top + slope * offset + bend * offset**2)
    at_hz = float(np.exp(x[1] + offset))
    ends_hz = _ends_hz(frequency_hz, height, place, peak + float(np.log(_HALF_POWER)))
    found = CurvePeak(
        frequency_hz=at_hz,
        magnitude=float(np.exp(peak)),
        relative_sd=float(spread[place]),
        half_power_width_hz=None if ends_hz is None else ends_hz[1] - ends_hz[0],
    )
    if ends_hz is None:
        return found, _USUAL_HALF_WIDTH * at_hz
    return found, max(at_hz - ends_hz[0], ends_hz[1] - at_hz)


def _ends_hz(frequency_hz: Reals, height: Reals, place: int, level: float) -> tuple[float, float] | None:
    ends = []
    for step in (-1, 1):
        here = place
        while 0 <= here + step < height.size and height[here + step] > level:
            if height[here + step] > height[place]:
                return None
            here += step
        if not 0 <= here + step < height.size:
            return None
        share = (height[here] - level) / (height[here] - height[here + step])
        ends.append(frequency_hz[here] + share * (frequency_hz[here + step] - frequency_hz[here]))
    low_hz, high_hz = sorted(map(float, ends))
    return low_hz, high_hz


SAME_HZ = 0.01
"""Largest difference between two frequencies that count as equal [Hz]."""


def predicted_curves(name: str, found: ResponsePrediction) -> Iterator[Curve]:
    """Yield the curves of predicted Responses I and II."""
    low, high = 1e6 * float(found.amplitude_m.min()), 1e6 * float(found.amplitude_m.max())
    level = f"{low:.3g} µm" if low == high else f"{low:.3g} to {high:.3g} µm"
    note = f"sines of A0 = {level}, {found.accuracy.value} accuracy"
    unknown = np.full(found.frequency_hz.shape, np.nan)
    values = (found.response_i, found.response_ii, unknown)
    yield from _responses(name, CurveOrigin.PREDICTED, found.frequency_hz, values, note)


def noise_traces(name: str, origin: CurveOrigin, response: NoiseResponse) -> Iterator[Curve]:
    """Yield the curve of an estimated transmission, with the standard deviation of the curve."""
    found = response.frequency_response
    how = found.settings
    note = f"{how.estimator.value}, {found.n_eff:.3g} averages, lines {found.resolution_hz:.3g} Hz wide"
    yield Curve(
        name,
        origin,
        CurveKind.TRANSMISSIBILITY,
        found.frequency_hz,
        found.magnitude,
        found.relative_sd_magnitude,
        note,
    )


def sweep_traces(name: str, origin: CurveOrigin, found: SweptMotion) -> Iterator[Curve]:
    """Yield the curves of Responses I and II of a sweep."""
    note = f"{found.sweep_rate_hz_per_s:+.3g} Hz/s"
    yield from _responses(
        name, origin, found.frequency_hz, (found.response_i, found.response_ii, found.sd_response_ii), note
    )


def stepped_traces(name: str, origin: CurveOrigin, found: SteppedResponse) -> Iterator[Curve]:
    """Yield separate curves for upward and downward steps, whose responses differ between the jumps."""
    if found.frequency_hz.size > 1 and np.ptp(found.frequency_hz) < SAME_HZ:
        return  # several levels at one frequency are not a curve over frequency
    directions = np.array(found.direction)
    for direction in dict.fromkeys(found.direction):
        at = directions == direction
        values = (found.response_i[at], found.response_ii[at], found.sd_response_ii[at])
        yield from _responses(
            f"{name} {direction}", origin, found.frequency_hz[at], values, f"steps {direction}"
        )


def dwell_traces(name: str, origin: CurveOrigin, found: DwellResponse) -> Iterator[Curve]:
    """Yield Responses I and II of a dwell as curves of one point."""
    values = np.array([[found.response_i], [found.response_ii], [found.sd_response_ii]])
    note = f"window of {found.window_s:.3g} s, A0 = {1e6 * found.drive.amplitude_m:.3g} µm"
    yield from _responses(name, origin, np.array([found.drive.frequency_hz]), values, note)


def _responses(
    name: str, origin: CurveOrigin, frequency_hz: Reals, values: Iterable[Reals], note: str
) -> Iterator[Curve]:
    first, second, sd_second = values
    unknown = np.full(frequency_hz.shape, np.nan)
    yield Curve(name, origin, CurveKind.RESPONSE_I, frequency_hz, first, unknown, note)
    yield Curve(name, origin, CurveKind.RESPONSE_II, frequency_hz, second, sd_second / second, note)
