"""One run as it is watched: samples go in, and every picture of a frame is asked for when it is drawn.

The history of a sine or a sweep so far: responses and extremes against the frequency really played.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from ..frequency_response.results import FrequencyResponse
from ..recordings.channels import BASE, DRIVE, RESPONSE
from ..signals.arrays import Reals
from ._impacts import ImpactCounter
from ._levels import Level, LevelMeters
from ._outline import Samples, column_starts, outline
from ._portrait import PoincareSection, Portrait, portrait, portrait_samples
from ._ring import Ring
from ._sine_response import SinePoint, look_samples, sine_point, stretch_samples
from ._spectra import DEFAULT_SETTINGS, LiveSpectra, LiveSpectrum, SpectrumSettings

MOST_POINTS = 36_000
"""An hour at ten points a second; the oldest go first."""
_COLUMNS = tuple(each.name for each in fields(SinePoint))


@dataclass(frozen=True, eq=False)
class SweepHistory:
    """All points so far, in the order of time; arrays of shape (points,)."""

    time_s: Reals
    frequency_hz: Reals
    drive_amplitude_m: Reals
    lower: Reals
    upper: Reals
    response_i: Reals
    response_ii: Reals


class SweepTrace:
    """Keeps points as they come, in memory that was claimed at the beginning."""

    def __init__(self, most: int = MOST_POINTS) -> None:
        self._most = most
        self._rows = np.empty((len(_COLUMNS), 2 * most))
        self._begin = self._end = 0

    @property
    def points(self) -> int:
        """How many are kept."""
        return self._end - self._begin

    def add(self, point: SinePoint) -> None:
        """Keep one more."""
        if self._end == self._rows.shape[1]:
            self._rows[:, : self.points] = self._rows[:, self._begin : self._end].copy()
            self._begin, self._end = 0, self.points
        self._rows[:, self._end] = [getattr(point, name) for name in _COLUMNS]
        self._end += 1
        self._begin = max(self._begin, self._end - self._most)

    def history(self) -> SweepHistory:
        """Return all points."""
        return SweepHistory(*self._rows[:, self._begin : self._end].copy())


HELD_S = 10.0
_POINT_EVERY_S = 0.1
"""Points of a sweep's course, and portraits, change this often; the other pictures with every frame."""
_LOWEST_DRIVE_HZ = 10.0
_FREQUENCY_RESPONSE_ROLES = (BASE, RESPONSE, DRIVE)


@dataclass(frozen=True)
class LiveChannel:
    """What is to be known of a channel to watch it."""

    role: str
    unit: str
    units_per_volt: float
    full_scale_v: float


@dataclass(frozen=True, eq=False)
class TimeHistories:
    """The newest seconds of every channel, as they are drawn."""

    time_s: Reals
    """Left edge of each column, since the run began, shape (columns,)."""
    low: Samples
    """Shape (channels, columns), in the channels' units; lost samples are NaN."""
    high: Samples


class LiveView:
    """Keeps what the pictures of one run need; a new run begins a new view.

    Parameters
    ----------
    channels
        In the order of the samples.
    band_hz
        What the measurement excites: the transmission is shown in it, and no drive is looked for below.
    delay_s
        By how much the response channel lags the base channel.
    lead_in_s
        Until then the motion comes up and settles: it makes no point of a course, and no Poincaré point.

    """

    def __init__(
        self,
        channels: Sequence[LiveChannel],
        sample_rate_hz: float,
        *,
        band_hz: tuple[float, float],
        delay_s: float = 0.0,
        lead_in_s: float = 0.0,
        settings: SpectrumSettings = DEFAULT_SETTINGS,
    ) -> None:
        self.channels = tuple(channels)
        """In the order of the time histories."""
        self._rate_hz = sample_rate_hz
        self._band_hz = band_hz
        self._delay_s = delay_s
        self._lead_in = round(lead_in_s * sample_rate_hz)
        self._units_per_volt = np.array([[each.units_per_volt] for each in channels], dtype=np.float32)
        self._rows = {each.role: row for row, each in enumerate(channels)}
        self._ring = Ring(len(channels), round(HELD_S * sample_rate_hz))
        self._spectra = LiveSpectra(len(channels), sample_rate_hz, settings)
        self._impacts = ImpactCounter(sample_rate_hz)
        self._meters = LevelMeters(np.array([each.full_scale_v for each in channels]), sample_rate_hz)
        self.levels: tuple[Level, ...] = ()
        """Meters, in the order of the channels; empty before the first sample."""
        self._trace = SweepTrace()
        self._pointed = 0
        self.section = PoincareSection()
        """The Poincaré points of all portraits so far."""
        self._portrait: tuple[int, Portrait | None] = (-(10**12), None)
        self._frequency_response: tuple[int, FrequencyResponse | None] = (0, None)
        self._spectrum: tuple[int, LiveSpectrum | None] = (0, None)

    @property
    def next_sample(self) -> int:
        """Number of the first sample that is still wanted."""
        return self._ring.next_sample

    def add(self, first_sample: int, volts: NDArray[np.float32]) -> None:
        """Take samples [V], shape (channels, samples); those that are already there are passed over."""
        begun = self._ring.next_sample if self._ring.held else first_sample
        self._ring.add(first_sample, volts * self._units_per_volt)
        fresh = self._ring.since(begun).values
        if fresh.shape[1] == 0:
            return
        self._spectra.add(fresh)
        self.levels = self._meters.add(fresh / self._units_per_volt)
        if RESPONSE in self._rows:
            self._impacts.add(fresh[self._rows[RESPONSE]])
        if self._has(DRIVE, BASE, RESPONSE) and self._is_point_due():
            self._add_point()

    def time_histories(self, span_s: float, columns: int) -> TimeHistories:
        """Return the newest seconds as columns of a picture."""
        window = self._ring.newest(round(span_s * self._rate_hz))
        low, high = outline(window.values, columns)
        starts = column_starts(window.values.shape[1], columns)
        return TimeHistories((window.first_sample + starts) / self._rate_hz, low, high)

    def spectrum(self) -> LiveSpectrum | None:
        """Return the spectral density of every channel; None before the first segment."""
        if self._spectrum[0] != self._spectra.segments:
            self._spectrum = (self._spectra.segments, self._spectra.spectrum())
        return self._spectrum[1]

    def frequency_response(self) -> FrequencyResponse | None:
        """Return |x / U| of the newest segments, with coherence and bounds; None before two of them."""
        if not self._has(BASE, RESPONSE):
            return None
        if self._frequency_response[0] != self._spectra.segments:
            rows = [self._rows[role] for role in _FREQUENCY_RESPONSE_ROLES if role in self._rows]
            low_hz, high_hz = self._band_hz
            found = self._spectra.frequency_response(
                rows, low_hz=low_hz, high_hz=high_hz, delay_s=self._delay_s
            )
            self._frequency_response = (self._spectra.segments, found)
        return self._frequency_response[1]

    def leave_out(self, newest_s: float) -> None:
        """Take spectra and transmission from samples before the newest seconds, and from those to come."""
        self._spectra.leave_out(newest_s)
        self._spectrum = self._frequency_response = (-1, None)

    def portrait(self) -> Portrait | None:
        """Return the orbit of the newest periods, and keep its Poincaré points; None without a sine."""
        if not self._has(DRIVE, RESPONSE):
            return None
        if self._ring.next_sample - self._portrait[0] < _POINT_EVERY_S * self._rate_hz:
            return self._portrait[1]
        lowest_hz = max(_LOWEST_DRIVE_HZ, 0.9 * self._band_hz[0])
        wanted = max(portrait_samples(lowest_hz, self._rate_hz), look_samples(self._rate_hz))
        found = portrait(
            self._ring.newest(wanted),
            self._rows[DRIVE],
            self._rows[RESPONSE],
            self._rate_hz,
            delay_s=self._delay_s,
        )
        if found is not None and np.all(found.strobe_sample >= self._lead_in):
            self.section.add(found)
        self._portrait = (self._ring.next_sample, found)
        return found

    def history(self) -> SweepHistory:
        """Return Responses I and II and extremes against the frequency really played, so far."""
        return self._trace.history()

    @property
    def impacts(self) -> int:
        """Kinks in m0's acceleration since the run began."""
        return self._impacts.count

    def _has(self, *roles: str) -> bool:
        return all(role in self._rows for role in roles)

    def _settled(self) -> int:
        """Count the samples since the lead-in was over."""
        return max(0, self._ring.next_sample - self._lead_in)

    def _is_point_due(self) -> bool:
        return self._ring.next_sample - self._pointed >= _POINT_EVERY_S * self._rate_hz

    def _add_point(self) -> None:
        self._pointed = self._ring.next_sample
        lowest_hz = max(_LOWEST_DRIVE_HZ, 0.9 * self._band_hz[0])
        wanted = max(stretch_samples(lowest_hz, self._rate_hz), look_samples(self._rate_hz))
        rows = (self._rows[DRIVE], self._rows[BASE], self._rows[RESPONSE])
        newest = self._ring.newest(min(wanted, self._settled()))
        point = sine_point(newest, rows, self._rate_hz)
        if point is not None:
            self._trace.add(point)
