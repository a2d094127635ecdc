"""Live Responses I and II, phase portrait and Poincaré points during a sine or a slow sweep."""

from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
from scipy import fft

from ..errors import NotEnoughData
from ..signals import Complexes, Quantity, Reals, Window, converted_signal, taper
from ..tables import Tabular
from ..tones import between_lines
from ._outline import Samples
from ._ring import RingWindow

_LEAST_SHARE = 0.5
"""Minimum fraction of the power near the strongest spectral line for a signal to count as a sine."""
_NEIGHBOURS = 3
"""Number of neighbouring lines on each side; enough for a sine under a Hann window, even in a slow sweep."""
_LEAST_LINE = 4
"""Minimum number of periods to analyse; with fewer, the lines of sine and offset merge."""


@dataclass(frozen=True)
class DriveTone:
    """Sine in a short part of the drive signal."""

    frequency_hz: float
    """Frequency [Hz]; in a sweep, the frequency at the middle of the samples."""
    amplitude: float
    """Peak amplitude of the sine [unit of the channel]."""


@lru_cache(maxsize=32)
def _hann(samples: int) -> Reals:
    """Return a cached Hann window; computing it costs as much as a Fourier transform."""
    return taper(Window.HANN, samples)


def drive_tone(drive: Samples, sample_rate_hz: float) -> DriveTone | None:
    """Return the sine in a short part of the drive, shape (samples,); None if the drive is not a sine."""
    if drive.size < 2 * _LEAST_LINE:
        return None
    values = _hann(drive.size)
    size = np.abs(fft.rfft((drive - np.mean(drive)) * values))
    line = int(np.argmax(size[:-1]))
    power = float(np.sum(size**2))
    around = size[max(0, line - _NEIGHBOURS) : line + _NEIGHBOURS + 1]
    if line < _LEAST_LINE or not float(np.sum(around**2)) > _LEAST_SHARE * power:
        return None
    place, height = between_lines(size, line)
    return DriveTone(place * sample_rate_hz / drive.size, 2 * height / float(np.sum(values)))


def drive_turns(drive: Reals, sample_rate_hz: float, frequency_hz: float) -> Reals:
    """Return the times of the maxima of the drive signal, a cosine or a slow sweep [samples].

    The drive is demodulated with its frequency and low-pass filtered at half this frequency, which leaves its
    slow phase. A tenth of the stretch at each end is left out, because the filter is inaccurate there.
    """
    half = max(2, int(0.5 * frequency_hz * drive.size / sample_rate_hz))
    if half < _LEAST_LINE:
        raise NotEnoughData(
            f"{drive.size / sample_rate_hz:.3g} s contain too few periods of {frequency_hz:.3g} Hz; show more"
        )
    spectrum = fft.rfft((drive - np.mean(drive)) * _hann(drive.size))
    middle = round(frequency_hz * drive.size / sample_rate_hz)
    slow = np.zeros(fft.next_fast_len(4 * half), dtype=np.complex128)
    kept = spectrum[middle - half : middle + half + 1]
    slow[np.arange(-half, -half + kept.size)] = kept
    phase = np.unwrap(np.angle(fft.ifft(slow)))
    place = np.arange(slow.size) * (drive.size / slow.size)
    inside = slice(slow.size // 10, slow.size - slow.size // 10)
    turns = (phase[inside] + 2 * np.pi * middle * place[inside] / drive.size) / (2 * np.pi)
    whole = np.arange(np.ceil(turns[0]), np.floor(turns[-1]) + 1)
    return np.asarray(np.interp(whole, turns, place[inside]))


_BAND_BELOW = 0.3
"""High-pass frequency for displacement, divided by the drive frequency; passes half orders but no drift."""
_BAND_ABOVE_HZ = 10_000.0
_LOOK_S = 0.5
"""Length [s] of the newest samples from which the drive frequency is found; five periods at 10 Hz."""
_STRETCH_PERIODS = 25
"""Number of drive periods for one point of the responses, without the disturbed ends; at least 0.1 s."""
_STRETCH_S = 0.1
_EDGE_PERIODS = 6 / _BAND_BELOW
_LEAST_KEPT = 0.9
"""Minimum ratio of final to initial drive amplitude in a point's samples; a lower ratio means a ramp-down."""
_STEEPEST_POWER = 2
"""Largest n in a sweep whose voltage is proportional to frequency^n (constant displacement)."""


@dataclass(frozen=True)
class SinePoint:
    """Responses and amplitudes, computed from some consecutive drive periods."""

    time_s: float
    """Time of the middle of the evaluated drive periods [s since the first sample of the run]."""
    frequency_hz: float
    drive_amplitude_m: float
    """Amplitude A0 of the base displacement at the drive frequency."""
    lower: float
    upper: float
    """Smallest and largest response velocity [m/s]."""
    response_i: float
    """Response I: largest abs(x) over A0."""
    response_ii: float
    """Response II: amplitude of x at the drive frequency over A0."""


def stretch_samples(frequency_hz: float, sample_rate_hz: float) -> int:
    """Return the number of samples for one point of the responses, including the disturbed ends."""
    wanted_s = max(_STRETCH_S, _STRETCH_PERIODS / frequency_hz) + 2 * _EDGE_PERIODS / frequency_hz
    return fft.next_fast_len(int(np.ceil(wanted_s * sample_rate_hz)), real=True)


def look_samples(sample_rate_hz: float) -> int:
    """Return the number of samples needed to find the drive frequency."""
    return fft.next_fast_len(round(_LOOK_S * sample_rate_hz), real=True)


def sine_point(
    window: RingWindow,
    rows: tuple[int, int, int],
    sample_rate_hz: float,
    quantity: Quantity = Quantity.VELOCITY,
) -> SinePoint | None:
    """Return Responses I and II from the newest samples.

    None without a sine, with too few or lost samples, and while the drive is ramped down (m0 then still rings
    while the base hardly moves).

    Parameters
    ----------
    window
        Samples in physical units; only as many of the newest samples as needed are used.
    rows
        Row numbers of drive, base acceleration and response.
    quantity
        Quantity of the response channel.
    """
    look = look_samples(sample_rate_hz)
    newest = np.asarray(window.values[list(rows), -look:], dtype=np.float64)
    if newest.shape[1] < look or not np.isfinite(newest).all():
        return None
    tone = drive_tone(newest[0], sample_rate_hz)
    if tone is None:
        return None
    count = stretch_samples(tone.frequency_hz, sample_rate_hz)
    stretch = np.asarray(window.values[list(rows), -count:], dtype=np.float64)
    if stretch.shape[1] < count or not np.isfinite(stretch).all():
        return None
    if _is_ramped_down(stretch[0], sample_rate_hz):
        return None
    middle_s = (window.stop_sample - 0.5 * count) / sample_rate_hz
    return _point(middle_s, stretch, sample_rate_hz, tone.frequency_hz, quantity)


def _is_ramped_down(drive: Reals, sample_rate_hz: float) -> bool:
    """Return whether the drive amplitude falls more steeply than in a downward sweep."""
    quarter = drive.size // 4
    first, last = (drive_tone(each, sample_rate_hz) for each in (drive[:quarter], drive[-quarter:]))
    if first is None or last is None:
        return first is not None
    swept = min(1.0, last.frequency_hz / first.frequency_hz) ** _STEEPEST_POWER
    return last.amplitude < _LEAST_KEPT * swept * first.amplitude


def _point(
    time_s: float, stretch: Reals, sample_rate_hz: float, near_hz: float, quantity: Quantity
) -> SinePoint | None:
    """Return a point; all quantities are from the same samples, because all change during a sweep."""
    tone = drive_tone(stretch[0], sample_rate_hz)
    frequency_hz = near_hz if tone is None else tone.frequency_hz
    omega = 2 * np.pi * frequency_hz
    # The complex peak amplitudes of the signals at one frequency.
    values = _hann(stretch.shape[-1])
    turns = np.exp(-2j * np.pi * frequency_hz / sample_rate_hz * np.arange(stretch.shape[-1]))
    found: Complexes = np.asarray(stretch @ (values * turns), dtype=np.complex128)
    _, base, response = found * (2 / float(np.sum(values)))
    displacement, velocity = motion_of(stretch[2], sample_rate_hz, frequency_hz, quantity)
    amplitude_m = float(abs(base)) / omega**2
    if displacement.size == 0 or amplitude_m == 0.0:
        return None
    return SinePoint(
        time_s=time_s,
        frequency_hz=frequency_hz,
        drive_amplitude_m=amplitude_m,
        lower=float(velocity.min()),
        upper=float(velocity.max()),
        response_i=float(np.max(np.abs(displacement))) / amplitude_m,
        response_ii=float(abs(response)) * omega**-quantity.derivatives / amplitude_m,
    )


def motion_of(
    response: Reals, sample_rate_hz: float, frequency_hz: float, quantity: Quantity
) -> tuple[Reals, Reals]:
    """Return displacement and velocity for a drive frequency, without the disturbed ends."""
    converted = partial(
        converted_signal,
        response,
        sample_rate_hz,
        given=quantity,
        low_hz=_BAND_BELOW * frequency_hz,
        high_hz=min(_BAND_ABOVE_HZ, 0.5 * sample_rate_hz),
    )
    displacement = converted(wanted=Quantity.DISPLACEMENT).settled
    if quantity is not Quantity.VELOCITY:
        return displacement, converted(wanted=Quantity.VELOCITY).settled
    edge = (response.size - displacement.size) // 2
    return displacement, response[edge : edge + displacement.size]


SHOWN_PERIODS = 20
_ORBIT_EDGE_PERIODS = 25
"""Additional drive periods at each end of the orbit, needed for integration and drive phase."""
POINTS_A_PERIOD = 120
"""Points per period of the orbit; 2400 points in 20 periods are painted in about 1 ms."""
MOST_POINTS = 3000
"""Maximum number of Poincaré points; older points are dropped."""


@dataclass(frozen=True, eq=False)
class Portrait(Tabular):
    """Orbit of the newest periods, with one Poincaré point per drive period."""

    drive_hz: float
    orbit_displacement_m: Reals
    orbit_velocity_m_per_s: Reals
    """Displacement and velocity of the orbit, shape (samples,)."""
    strobe_displacement_m: Reals
    strobe_velocity_m_per_s: Reals
    """Poincaré points at the maxima of the drive, a cosine; shape (periods,)."""
    strobe_sample: Reals
    """Times of the Poincaré points, in samples since the start of the run."""


def portrait(
    window: RingWindow,
    drive_row: int,
    response_row: int,
    sample_rate_hz: float,
    quantity: Quantity = Quantity.VELOCITY,
    *,
    delay_s: float = 0.0,
) -> Portrait | None:
    """Return the phase portrait of the newest periods; None without a sine drive or with too few samples.

    Parameters
    ----------
    window
        Newest samples in physical units; `portrait_samples` of them are needed.
    delay_s
        Lag of the response channel behind the drive channel [s].
    quantity
        Quantity of the response channel.
    """
    look = look_samples(sample_rate_hz)
    drive = np.asarray(window.values[drive_row], dtype=np.float64)
    tone = drive_tone(drive[-look:], sample_rate_hz) if drive.size >= look else None
    if tone is None or not np.isfinite(window.values[[drive_row, response_row]]).all():
        return None
    count = portrait_samples(tone.frequency_hz, sample_rate_hz)
    if drive.size < count:
        return None
    response = np.asarray(window.values[response_row, -count:], dtype=np.float64)
    displacement, velocity = motion_of(response, sample_rate_hz, tone.frequency_hz, quantity)
    edge = (count - displacement.size) // 2
    turns = drive_turns(drive[-count:], sample_rate_hz, tone.frequency_hz) + delay_s * sample_rate_hz
    turns = turns[(turns >= edge) & (turns <= edge + displacement.size - 1)]
    stride = max(1, int(sample_rate_hz / tone.frequency_hz / POINTS_A_PERIOD))
    place = np.arange(displacement.size)
    return Portrait(
        drive_hz=tone.frequency_hz,
        orbit_displacement_m=displacement[::stride],
        orbit_velocity_m_per_s=velocity[::stride],
        strobe_displacement_m=np.interp(turns - edge, place, displacement),
        strobe_velocity_m_per_s=np.interp(turns - edge, place, velocity),
        strobe_sample=turns + (window.stop_sample - count),
    )


def portrait_samples(frequency_hz: float, sample_rate_hz: float) -> int:
    """Return the number of samples needed for a portrait."""
    wanted = (SHOWN_PERIODS + 2 * _ORBIT_EDGE_PERIODS) * sample_rate_hz / frequency_hz
    return fft.next_fast_len(int(np.ceil(wanted)), real=True)


class PoincareSection:
    """Poincaré points collected from overlapping portraits; each point is collected once."""

    def __init__(self, most: int = MOST_POINTS) -> None:
        self._most = most
        self.displacement_m: Reals = np.empty(0)
        """Displacement of the Poincaré points, shape (points,)."""
        self.velocity_m_per_s: Reals = np.empty(0)
        """Velocity of the Poincaré points, shape (points,)."""
        self._newest = -np.inf

    def add(self, found: Portrait) -> None:
        """Add points that are at least half a period later than the newest collected point."""
        if found.strobe_sample.size == 0:
            return
        spacing = float(np.min(np.diff(found.strobe_sample))) if found.strobe_sample.size > 1 else 1.0
        fresh = found.strobe_sample > self._newest + 0.5 * spacing
        displacement_m = np.append(self.displacement_m, found.strobe_displacement_m[fresh])
        velocity_m_per_s = np.append(self.velocity_m_per_s, found.strobe_velocity_m_per_s[fresh])
        self.displacement_m = displacement_m[-self._most :]
        self.velocity_m_per_s = velocity_m_per_s[-self._most :]
        self._newest = max(self._newest, float(found.strobe_sample[-1]))
