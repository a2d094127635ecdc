"""Live view of one run; pictures are computed only when they are drawn."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from math import factorial

import numpy as np
from numpy.typing import NDArray

from ..frequency_response.results import FrequencyResponse
from ..recordings.channels import BASE, DRIVE, RESPONSE, RESPONSE_ROLES
from ..signals import Quantity, Reals
from ._outline import Picture, column_starts, outline
from ._ring import Level, LevelMeters, Ring, Values
from ._sine_response import (
    PoincareSection,
    Portrait,
    SinePoint,
    look_samples,
    portrait,
    portrait_samples,
    sine_point,
    stretch_samples,
)
from ._spectra import LiveSpectra, LiveSpectrum

# Impacts are counted as kinks in the motion of m0. When m1 and m2 collide, springs and dampers transmit the
# velocity jump to m0: the acceleration of m0 jumps, and its slope changes. Such a kink always has one shape,
# and the motion between impacts is far slower. A sixth difference removes the smooth motion, and a matched
# filter finds the kinks. The strongest kink is subtracted first, until only noise is left. Impacts 0.1 ms
# apart are resolved. In simulated motions with the noise of the virtual rig (benchmarks/impact_counter.py),
# 88 to 99 % of 330 to 1800 impacts a second are counted; without impacts, none are. Only contacts that
# change m0's motion by less than the noise are missed.

_SPAN_S = 78e-6
"""Step of the sixth difference [s]; a longer step passes more of the motion, a shorter step more noise."""
_DAMPING_TIME_S = 2e-5
"""Damping time of m0's springs [s]: at an impact, step of the acceleration / change of its slope."""
_CONTACT_S = 30e-6
"""Assumed duration of a contact; contacts last 20 to 40 us."""
_APART_S = 100e-6
"""Two kinks that are less than this time apart are counted as one kink [s]."""
_LEAST_FRESH_S = 20e-3
"""Shortest piece of signal from which noise is estimated [s]."""
_MOST_FRESH_S = 0.1
"""Longest piece that is processed at once [s]."""
_NOISE_FACTOR = 5.2
"""Threshold of a kink in standard deviations of the noise; noise alone exceeds it once in two minutes."""
_SMOOTH_FACTOR = 3.0
"""Threshold of a kink relative to the filter output for a sine at the mean frequency of the motion."""
_REST_SHARE = 0.2
"""Smallest kink relative to a stronger neighbour; smaller kinks are residuals of the neighbour."""
_SIXTH_DIFFERENCE = np.array([1.0, -6.0, 15.0, -20.0, 15.0, -6.0, 1.0])
_NOISE_GAIN = np.sqrt(924.0)
"""Gain of the sixth difference for the rms of white noise."""
_QUIET_SHARE, _QUARTER_OF_NORMAL = 0.25, 0.3186
"""Quantile of |x| that measures the noise (impacts affect higher quantiles), and its value for unit noise."""


class ImpactCounter:
    """Counter of impacts in a motion that arrives in blocks."""

    def __init__(self, sample_rate_hz: float, quantity: Quantity = Quantity.VELOCITY) -> None:
        span = max(1, round(_SPAN_S * sample_rate_hz))
        self._difference = np.zeros(6 * span + 1)
        self._difference[::span] = _SIXTH_DIFFERENCE
        kink = _kink(self._difference, sample_rate_hz, 3 - quantity.derivatives)
        power = float(kink @ kink)
        # This filter combines difference and matched filter: it turns samples into strengths of kinks.
        self._finder = np.convolve(self._difference, kink[::-1]) / power
        self._gain = float(np.sqrt(np.sum(self._finder**2)))
        self._beam = np.correlate(kink, kink, mode="full") / power
        self._reach = kink.size - 1
        self._apart = max(1, round(_APART_S * sample_rate_hz))
        self._most = max(1, round(_MOST_FRESH_S * sample_rate_hz))
        self._least_fresh = round(_LEAST_FRESH_S * sample_rate_hz)
        self._carry = np.empty(0)
        self.count = 0
        """Number of impacts so far."""

    def add(self, motion: Values | Reals) -> int:
        """Add the next samples, shape (samples,), NaN if lost; return the number of new impacts."""
        starts = range(0, max(1, len(motion)), self._most)
        return sum(self._add_piece(motion[first : first + self._most]) for first in starts)

    def _add_piece(self, motion: Values | Reals) -> int:
        data = np.concatenate((self._carry, np.asarray(motion, dtype=np.float64)))
        # To separate a kink from neighbouring kinks, samples on both sides of the kink are needed.
        fresh = data.size - (self._finder.size - 1) - 2 * self._reach
        if fresh < self._least_fresh:
            self._carry = data
            return 0
        places = self._kinks(data)
        inside = places[(places >= self._reach) & (places < self._reach + fresh)]
        self.count += inside.size
        self._carry = data[fresh:].copy()
        return int(inside.size)

    def _kinks(self, data: Reals) -> "np.ndarray[tuple[int, ...], np.dtype[np.intp]]":
        """Return the sample positions of kinks; the strongest kink is found and subtracted first."""
        strength = np.nan_to_num(np.convolve(data, self._finder[::-1], mode="valid"))
        least = max(_NOISE_FACTOR * self._gain * _noise(data), _SMOOTH_FACTOR * self._smooth(data))
        size, beside = np.abs(strength), np.zeros(strength.size)
        places: list[int] = []
        for _ in range(strength.size):
            place = int(np.argmax(size))
            if not size[place] > least:
                break
            low, high = max(0, place - self._reach), min(strength.size, place + self._reach + 1)
            found = size[place]
            first = low - place + self._reach
            strength[low:high] -= strength[place] * self._beam[first : first + high - low]
            size[low:high] = np.abs(strength[low:high])
            if found >= _REST_SHARE * beside[place]:
                places.append(place)
                beside[low:high] = np.maximum(beside[low:high], found)
        inorder = np.sort(np.asarray(places, dtype=np.intp))
        return inorder[np.diff(inorder, prepend=-self._apart - 1) > self._apart]

    def _smooth(self, data: Reals) -> float:
        """Return the filter output for a sine with the same mean square and mean square slope as the data."""
        known = data[np.isfinite(data)]
        spread = float(np.std(known)) if known.size > 1 else 0.0
        if spread == 0.0:
            return 0.0
        turn = float(np.std(np.diff(known))) / spread
        left = np.abs(self._finder @ np.exp(1j * turn * np.arange(self._finder.size)))
        return float(np.sqrt(2) * spread * left)


def _noise(data: Reals) -> float:
    """Return the noise of one sample, estimated from the quiet samples; infinite without data."""
    known = data[np.isfinite(data)]
    if known.size <= _SIXTH_DIFFERENCE.size:
        return np.inf
    rough = np.abs(np.convolve(known, _SIXTH_DIFFERENCE, mode="valid")) / _NOISE_GAIN
    quiet = float(np.quantile(rough, _QUIET_SHARE)) / _QUARTER_OF_NORMAL
    # Samples have single precision, so the noise is at least one unit in the last digit.
    return max(quiet, float(np.finfo(np.float32).eps * np.max(np.abs(known))))


def _kink(difference: Reals, sample_rate_hz: float, power: int) -> Reals:
    """Return the filter output for one impact, at which a term t^power / power! is added to the motion."""
    around = np.arange(-difference.size, 2 * difference.size) / sample_rate_hz
    moments_s = np.linspace(-0.5 * _CONTACT_S, 0.5 * _CONTACT_S, 7)
    since = np.clip(around[:, np.newaxis] - moments_s, 0.0, None)
    step = (since > 0) * since ** (power - 1) / factorial(power - 1)
    motion = np.mean(since * step / power + _DAMPING_TIME_S * step, axis=1)
    shape = np.convolve(motion, difference, mode="valid")
    seen = np.flatnonzero(np.abs(shape) > 1e-3 * np.abs(shape).max())
    return np.asarray(shape[seen[0] : seen[-1] + 1])


MOST_POINTS = 36_000
"""Maximum number of sweep points: one hour at ten points per second; older points are dropped."""
_COLUMNS = tuple(each.name for each in fields(SinePoint))


@dataclass(frozen=True, eq=False)
class SweepHistory:
    """All sweep points of a run in the order of time; arrays of shape (points,)."""

    time_s: Reals
    frequency_hz: Reals
    drive_amplitude_m: Reals
    lower: Reals
    upper: Reals
    response_i: Reals
    response_ii: Reals


HELD_S = 10.0
_POINT_EVERY_S = 0.1
"""Update interval of sweep points and portraits [s]; other pictures are updated in every frame."""
_LOWEST_DRIVE_HZ = 10.0


@dataclass(frozen=True)
class LiveChannel:
    """Properties of a channel in the live view."""

    role: str
    unit: str
    units_per_volt: float
    full_scale_v: float


class LiveView:
    """Data for the pictures of one run.

    Parameters
    ----------
    channels
        Channels in the order of the rows of samples.
    band_hz
        Excited band [Hz]. Transmission is shown in this band, and the drive is not sought below it.
    delay_s
        Lag of the response channel behind the base channel [s].
    lead_in_s
        Start-up time without sweep points and Poincaré points [s].
    """

    def __init__(
        self,
        channels: Sequence[LiveChannel],
        sample_rate_hz: float,
        *,
        band_hz: tuple[float, float],
        delay_s: float = 0.0,
        lead_in_s: float = 0.0,
    ) -> None:
        self.channels = tuple(channels)
        """Channels in the order of the time histories."""
        self._rate_hz = sample_rate_hz
        self._band_hz = band_hz
        self._lowest_hz = max(_LOWEST_DRIVE_HZ, 0.9 * band_hz[0])
        self._delay_s = delay_s
        self._lead_in = round(lead_in_s * sample_rate_hz)
        self._units_per_volt = np.array([[each.units_per_volt] for each in channels], dtype=np.float32)
        self._rows = {each.role: row for row, each in enumerate(channels)}
        self._ring = Ring(len(channels), round(HELD_S * sample_rate_hz))
        self._spectra = LiveSpectra(len(channels), sample_rate_hz)
        self._response = next((role for role in RESPONSE_ROLES if role in self._rows), RESPONSE)
        self._quantity = Quantity(self._response.partition("_")[2])
        self._impacts = ImpactCounter(sample_rate_hz, self._quantity)
        self._meters = LevelMeters(np.array([each.full_scale_v for each in channels]), sample_rate_hz)
        self.levels: tuple[Level, ...] = ()
        """Levels in the order of the channels; empty before the first sample."""
        self._points: Reals = np.empty((len(_COLUMNS), 0))
        self._pointed = 0
        self.section = PoincareSection()
        """Poincaré points of all portraits so far."""
        self._portrait: tuple[int, Portrait | None] = (-(10**12), None)
        self._frequency_response: tuple[int, FrequencyResponse | None] = (0, None)
        self._spectrum: tuple[int, LiveSpectrum | None] = (0, None)

    @property
    def next_sample(self) -> int:
        """Index of the next sample to add."""
        return self._ring.next_sample

    def add(self, first_sample: int, volts: NDArray[np.float32]) -> None:
        """Add samples [V], shape (channels, samples); samples that were already added are skipped."""
        begun = self._ring.next_sample if self._ring.available else first_sample
        self._ring.add(first_sample, volts * self._units_per_volt)
        fresh = self._ring.samples_since(begun).values
        if fresh.shape[1] == 0:
            return
        self._spectra.add(fresh)
        self.levels = self._meters.add(fresh / self._units_per_volt)
        if self._response in self._rows:
            self._impacts.add(fresh[self._rows[self._response]])
        is_point_due = self._ring.next_sample - self._pointed >= _POINT_EVERY_S * self._rate_hz
        if self._has_roles(DRIVE, BASE, self._response) and is_point_due:
            self._add_point()

    def time_histories(self, span_s: float, columns: int) -> Picture:
        """Return the outline of the newest ``span_s`` seconds in ``columns`` columns."""
        window = self._ring.newest(round(span_s * self._rate_hz))
        low, high = outline(window.values, columns)
        starts = column_starts(window.values.shape[1], columns)
        time_s = (window.first_sample + starts) / self._rate_hz
        return Picture(time_s, low, high, window.values.shape[1] / max(starts.size, 1))

    def spectrum(self) -> LiveSpectrum | None:
        """Return the spectral density of every channel; None before the first segment."""
        if self._spectrum[0] != self._spectra.segments:
            self._spectrum = (self._spectra.segments, self._spectra.spectrum())
        return self._spectrum[1]

    def frequency_response(self) -> FrequencyResponse | None:
        """Return |x / U| of the newest segments, with coherence and bounds; None before two segments."""
        if not self._has_roles(BASE, self._response):
            return None
        if self._frequency_response[0] != self._spectra.segments:
            wanted = (BASE, self._response, DRIVE)
            rows = [self._rows[role] for role in wanted if role in self._rows]
            low_hz, high_hz = self._band_hz
            found = self._spectra.frequency_response(
                rows, self._quantity, low_hz=low_hz, high_hz=high_hz, delay_s=self._delay_s
            )
            self._frequency_response = (self._spectra.segments, found)
        return self._frequency_response[1]

    def leave_out(self, newest_s: float) -> None:
        """Exclude the newest seconds from spectra and transmission."""
        self._spectra.leave_out(newest_s)
        self._spectrum = self._frequency_response = (-1, None)

    def portrait(self) -> Portrait | None:
        """Return the newest orbit, and collect its Poincaré points; None without a sine drive."""
        if not self._has_roles(DRIVE, self._response):
            return None
        if self._ring.next_sample - self._portrait[0] < _POINT_EVERY_S * self._rate_hz:
            return self._portrait[1]
        wanted = max(portrait_samples(self._lowest_hz, self._rate_hz), look_samples(self._rate_hz))
        found = portrait(
            self._ring.newest(wanted),
            self._rows[DRIVE],
            self._rows[self._response],
            self._rate_hz,
            self._quantity,
            delay_s=self._delay_s,
        )
        if found is not None and np.all(found.strobe_sample >= self._lead_in):
            self.section.add(found)
        self._portrait = (self._ring.next_sample, found)
        return found

    def history(self) -> SweepHistory:
        """Return all sweep points: Responses I and II, velocity extremes and A0 over the drive frequency."""
        return SweepHistory(*self._points)

    @property
    def impacts(self) -> int:
        """Number of impacts since the start of the run."""
        return self._impacts.count

    def _has_roles(self, *roles: str) -> bool:
        return all(role in self._rows for role in roles)

    def _add_point(self) -> None:
        self._pointed = self._ring.next_sample
        wanted = max(stretch_samples(self._lowest_hz, self._rate_hz), look_samples(self._rate_hz))
        rows = (self._rows[DRIVE], self._rows[BASE], self._rows[self._response])
        newest = self._ring.newest(min(wanted, max(0, self._ring.next_sample - self._lead_in)))
        point = sine_point(newest, rows, self._rate_hz, self._quantity)
        if point is not None:
            newest_point = [[getattr(point, name)] for name in _COLUMNS]
            self._points = np.append(self._points[:, 1 - MOST_POINTS :], newest_point, axis=1)
