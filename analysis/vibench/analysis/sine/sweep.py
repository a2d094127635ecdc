"""Results of a sine sweep: envelope, responses and phase against the measured drive frequency.

The phase of the recorded drive is the time base of sweeps and dwells.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import partial
from math import ceil
from typing import ClassVar

import numpy as np
from scipy import fft

from ..errors import InvalidRequest, NotEnoughData, UnusableData
from ..recordings.channels import far_from
from ..signals import (
    Complexes,
    Decimator,
    Flags,
    Quantity,
    Reals,
    converted_signal,
    disturbed_samples,
)
from ..tables import Tabular
from ..tones import ALL_ORDERS, ORDERS, TrackedOrders, cycles_needed, noise_lift, track_orders, track_signals
from .dwell import LEAST_CLEAR

_MARGIN = 0.5
"""Margin beside the drive's band, relative to the band's end; the filter edge is its outer half."""
_EDGE_CYCLES = 8
"""Cycles at the lowest frequency after which the filter's ringing is below 1e-5 of a radian."""
_LEAST_CYCLES = 10
_LEAST_SHARE = 0.5
"""Minimum fraction of the drive channel's power that lies within the band of the drive."""


@dataclass(frozen=True)
class DrivePhase:
    """Unwrapped phase of a drive; the drive is cos(phase). Arrays of shape (samples,)."""

    phase_rad: Reals
    frequency_hz: Reals
    """Instantaneous frequency relative to the converter clock [Hz]."""


def drive_phase(drive: Reals, sample_rate_hz: float, *, low_hz: float, high_hz: float) -> DrivePhase:
    """Measure the phase of a sine drive, steady or sweeping, from its analytic signal.

    No nominal value is used: 10 ppm between the clocks of generator and converter would shift the phase
    of a nominal 150 to 350 Hz sweep by 250 degrees at its end.

    Parameters
    ----------
    drive
        The recorded generator voltage, shape (samples,).
    low_hz, high_hz
        Range of the drive frequency; components well outside are ignored.
    """
    if drive.size < _LEAST_CYCLES * sample_rate_hz / low_hz:
        raise NotEnoughData(
            f"the drive contains {drive.size * low_hz / sample_rate_hz:.1f} cycles at {low_hz:g} Hz; "
            f"its phase needs at least {_LEAST_CYCLES} cycles"
        )
    edge = min(int(_EDGE_CYCLES * sample_rate_hz / low_hz), drive.size // 8)
    padded = fft.next_fast_len(drive.size + edge)
    spectrum = fft.fft(drive - np.mean(drive), padded)
    band = _band(fft.fftfreq(padded, 1 / sample_rate_hz), low_hz, high_hz)
    power = np.sum(np.abs(spectrum) ** 2)
    kept = 2 * spectrum * band
    if not np.sum(np.abs(kept) ** 2) / 2 > _LEAST_SHARE * power:
        raise UnusableData(
            f"the drive channel contains no sine between {low_hz:g} and {high_hz:g} Hz; "
            "check the channel and the frequencies"
        )
    analytic = fft.ifft(kept, overwrite_x=True)[: drive.size]
    phase = _continue_phase(np.unwrap(np.angle(analytic)), edge)
    return DrivePhase(
        phase_rad=phase,
        frequency_hz=np.gradient(phase) * (sample_rate_hz / (2 * np.pi)),
    )


def _band(frequency_hz: Reals, low_hz: float, high_hz: float) -> Reals:
    """Return the weights of a band around the drive; cosine edges limit the ringing to a few cycles."""
    rise = (frequency_hz / low_hz - (1 - _MARGIN)) / (_MARGIN / 2)
    fall = ((1 + _MARGIN) - frequency_hz / high_hz) / (_MARGIN / 2)
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.clip(np.minimum(rise, fall), 0.0, 1.0)))


def _continue_phase(phase: Reals, edge: int) -> Reals:
    """Replace the disturbed ends by a parabola fitted to their neighbours."""
    if edge == 0:
        return phase
    place = np.arange(3 * edge, dtype=np.float64) / edge - 2
    result = phase.copy()
    for ends in (slice(None), slice(None, None, -1)):
        side = result[ends]
        parabola = np.polynomial.Polynomial.fit(place, side[edge : 4 * edge], 2)
        side[:edge] = parabola(np.arange(-edge, 0) / edge - 2)
    return result


_SAMPLES_PER_CYCLE = 24
"""Minimum samples per cycle at the highest drive frequency, so that sampled maxima are at most 0.9 % low."""
_BAND_BELOW = 0.25
"""High-pass frequency for displacement / lowest drive frequency; half orders pass, drift does not."""
_BAND_ABOVE = 0.3
"""Low-pass frequency relative to the decimated rate, within the flat band of the decimation."""
_LINEAR_ABOVE = 5.5
"""Upper frequency limit of the linear motion, relative to the highest drive frequency; above order 5."""
_STEADY_POINTS = 10_001
_PEAK_POINTS = 401
_SAME_LARGEST = 0.03
"""Largest relative difference from the linear simulation at which the largest Response II agrees with it."""
_LINES = 1 << 15
"""Largest number of frequencies at which linear motion is computed in one batch."""
_BRIDGE_PERIODS = 3.0
"""Periods of the lower band edge in which an error from bridging decays from 3 to 0.02 times the motion."""
_ROOM = 1.1
"""Factor on the length of the longer intervals; the first of them may start slightly below the band."""
_DRIVE, _BASE, _RESPONSE = range(3)


@dataclass(frozen=True)
class SweptMotion(Tabular):
    """Quantities of a sweep, recorded or simulated (a draw); arrays of shape (intervals,) unless stated."""

    OWN_UNITS: ClassVar = {
        "upper": "m s-1",
        "lower": "m s-1",
        "velocity": "m s-1",
        "noise_rms": "m s-1",
    }
    DOCUMENT: ClassVar = (
        "start_hz=frequency_hz.0 stop_hz=frequency_hz.-1 sweep_rate_hz_per_s "
        "drive_amplitude_start_m=drive_amplitude_m.0 drive_amplitude_stop_m=drive_amplitude_m.-1 "
        "largest_response_i=largest_i largest_response_ii=largest_ii.0 "
        "largest_response_ii_at_hz=largest_ii.1 steady_over_swept_linear=steady_over_swept"
    )

    time_s: Reals
    """Centre of each interval, from the first sample of the sweep."""
    frequency_hz: Reals
    """Mean frequency of the recorded drive in each interval."""
    upper: Reals
    lower: Reals
    """Largest and smallest value of the recorded response at the full sample rate [m/s]."""
    drive_amplitude_m: Reals
    """Base displacement A0 at the drive frequency, from the recorded acceleration [m]."""
    sd_drive_amplitude_m: Reals
    velocity: TrackedOrders
    """The response's velocity at orders of the drive [m/s]."""
    peak_displacement_m: Reals
    """Largest |x| in the interval [m]."""
    response_i: Reals
    """Largest |x| outside drop-outs, divided by the drive amplitude; NaN if drop-outs leave too little."""
    response_ii: Reals
    """Amplitude of x at the drive frequency, divided by the drive amplitude."""
    sd_response_ii: Reals
    phase_rad: Reals
    """Phase lead of x over the base displacement at the drive frequency, without the channels' delay."""
    is_clear: Flags
    """Flags of intervals without a drop-out, shape (intervals,)."""
    noise_rms: float
    """Noise of the velocity channel within the band of ``velocity.residual_rms`` [m/s]."""
    linear_residual: Reals
    """Residual relative to order 1, simulated without contact in this sweep; NaN without a specimen."""
    linear_ii: Reals
    """Response II, simulated without contact in this sweep, including ringing."""
    linear_impacts: Reals
    """Orders 2 and 3 relative to order 1, without contact; modes may ring at twice the drive frequency."""
    steady_over_swept: float
    """Largest Response II without contact: value for steady sines divided by value in this sweep. NaN if the
    measured Response II differs from that in this sweep, for example while the specimen still rings."""
    interval_s: float

    def largest(self, response: Reals) -> int:
        """Return the index of the largest value among the intervals without a drop-out."""
        return int(np.nanargmax(np.where(self.is_clear, response, np.nan)))

    @property
    def largest_i(self) -> float:
        """Largest Response I in the sweep."""
        return float(self.response_i[self.largest(self.response_i)])

    @property
    def largest_ii(self) -> tuple[float, float]:
        """Largest Response II, and its frequency [Hz]."""
        top = self.largest(self.response_ii)
        return float(self.response_ii[top]), float(self.frequency_hz[top])

    @property
    def sweep_rate_hz_per_s(self) -> float:
        """Mean rate of the sweep; negative downwards."""
        return float(np.polyfit(self.time_s, self.frequency_hz, 1)[0])


@dataclass(frozen=True)
class SweepResponse(SweptMotion):
    """A measured sweep; arrays of shape (intervals,) unless stated otherwise."""

    OWN_UNITS: ClassVar = {**SweptMotion.OWN_UNITS, "harmonics": "m"}

    harmonics: TrackedOrders
    """Displacement at orders 1/3 to 5 [m], in longer intervals centred at `harmonics_hz`."""
    harmonics_hz: Reals
    """Drive frequency at the centre of each longer interval, shape (longer intervals,)."""
    noise_bias_i: Reals
    noise_error_i: Reals
    """Expected bias and rms error of Response I due to noise."""


Transmission = Callable[[Reals], Complexes]
"""Function of frequency [Hz]: ratio of m0's displacement to the base's; both have shape (lines,)."""


class SweepSums:
    """Analysis of a sweep that arrives in blocks; keeps about a sixth of the samples.

    Parameters
    ----------
    sample_rate_hz
        Sample rate of the blocks.
    low_hz, high_hz
        Lower and upper end of the sweep, for both directions.
    interval_s
        Length of one interval; half orders need two cycles of half the drive frequency.
    clock
        Phase of the drive, if known; the drive in the blocks is then ignored.
    """

    def __init__(
        self,
        sample_rate_hz: float,
        *,
        low_hz: float,
        high_hz: float,
        interval_s: float = 0.1,
        clock: DrivePhase | None = None,
    ) -> None:
        if not 0 < low_hz < high_hz < sample_rate_hz / 4:
            raise InvalidRequest(
                f"a sweep from {low_hz:g} to {high_hz:g} Hz was stated; give ascending frequencies "
                f"above 0 and below {sample_rate_hz / 4:g} Hz, a quarter of the sample rate"
            )
        self._factor = max(1, int(sample_rate_hz / (_SAMPLES_PER_CYCLE * high_hz)))
        self._rate_hz = sample_rate_hz / self._factor
        self._interval = max(1, round(interval_s * self._rate_hz))
        self._low_hz, self._high_hz = low_hz, high_hz
        self._before = self._after = 0
        """Number of samples added before and after the sweep."""
        self._clock = clock
        self._first_row = _DRIVE if clock is None else _BASE
        self._decimator = Decimator(3 - self._first_row, self._factor)
        self._parts: list[Reals] = []
        self._carry = np.empty((2, 0))
        self._bridged: list[Flags] = []
        self._extremes: list[Reals] = []

    @property
    def neighbour_samples(self) -> int:
        """Number of samples that the displacement needs before and after the sweep, in whole intervals."""
        disturbed = disturbed_samples(self._rate_hz, _BAND_BELOW * self._low_hz)
        return self._factor * self._interval * ceil(disturbed / self._interval)

    def add_neighbour(self, block: Reals, bridged: Flags | None = None) -> None:
        """Add the record directly before or after the sweep.

        Without this record, integration of velocity makes the largest |x| of the first and last intervals
        wrong by up to a third.
        """
        if self._extremes:
            self._after += block.shape[1]
        else:
            self._before += block.shape[1]
        self._parts.append(self._decimator.add(block[self._first_row :]))
        self._bridged.append(np.zeros(block.shape[1], dtype=np.bool_) if bridged is None else bridged)

    def add(self, block: Reals, bridged: Flags | None = None) -> None:
        """Add the next samples of the sweep: rows drive voltage, base acceleration, response velocity.

        ``bridged`` marks samples that bridge a drop-out; none by default.
        """
        if block.shape[0] != 3:
            raise InvalidRequest(f"a block has {block.shape[0]} rows; a sweep takes drive, base and response")
        self._parts.append(self._decimator.add(block[self._first_row :]))
        self._bridged.append(np.zeros(block.shape[1], dtype=np.bool_) if bridged is None else bridged)
        full = self._interval * self._factor
        seen = np.where(self._bridged[-1], 0.0, block[_RESPONSE])
        data = np.concatenate((self._carry, np.stack((block[_RESPONSE], seen))), axis=1)
        count = data.shape[1] // full
        whole, seen = data[:, : count * full].reshape(2, count, full)
        # The sixth difference removes the smooth motion and multiplies the rms of white noise by sqrt(924).
        noise = np.diff(whole, 6, axis=1)
        self._extremes.append(
            np.stack((seen.max(axis=1), seen.min(axis=1), np.sqrt(np.mean(noise**2, axis=1) / 924)))
        )
        self._carry = data[:, count * full :].copy()

    def response(self, *, delay_s: float = 0.0, linear: Transmission | None = None) -> SweepResponse:
        """Analyse all samples; no more blocks can be added afterwards.

        Parameters
        ----------
        delay_s
            Lag of the response channel behind the base channel [s].
        linear
            Transmission of the specimen without contact, for comparison in the same sweep.
        """
        motion, swept, velocity, phase = self._evaluate(delay_s, linear)
        harmonics, harmonics_hz = self._harmonics(velocity, phase)
        low_hz, high_hz = self._band_hz
        noise_density = motion.noise_rms / np.sqrt(self._rate_hz / 2)
        noise_m = noise_density / (2 * np.pi) * np.sqrt(1 / low_hz - 1 / high_hz)
        independent = 2 * np.sqrt(low_hz * high_hz) * self._interval / self._rate_hz
        bias_m, error_m = np.transpose([noise_lift(each, noise_m, independent) for each in swept])
        return SweepResponse(
            **{each.name: getattr(motion, each.name) for each in fields(motion)},
            harmonics=harmonics,
            harmonics_hz=harmonics_hz,
            noise_bias_i=bias_m / motion.drive_amplitude_m,
            noise_error_i=error_m / motion.drive_amplitude_m,
        )

    def motion(self, *, delay_s: float = 0.0, linear: Transmission | None = None) -> SweptMotion:
        """Return the quantities that are needed from simulated records (draws); see `response`."""
        return self._evaluate(delay_s, linear)[0]

    @property
    def clock(self) -> DrivePhase:
        """Phase of the drive, after the analysis."""
        assert self._clock is not None
        return self._clock

    @property
    def _band_hz(self) -> tuple[float, float]:
        """Frequency band of the displacement [Hz]."""
        return _BAND_BELOW * self._low_hz, _BAND_ABOVE * self._rate_hz

    def _evaluate(
        self, delay_s: float, linear: Transmission | None
    ) -> tuple[SweptMotion, Reals, Reals, DrivePhase]:
        """Return results, displacement x (intervals, samples) [m], velocity [m/s] and drive phase."""
        self._parts.append(self._decimator.finish())
        whole = np.concatenate(self._parts, axis=1)
        self._parts.clear()
        inside = slice(self._before // self._factor, whole.shape[1] - self._after // self._factor)
        data = whole[:, inside]
        count = data.shape[1] // self._interval
        extremes = np.concatenate(self._extremes or [np.empty((3, 0))], axis=1)
        upper, lower, noise = extremes[:, :count]
        if upper.size == 0:
            raise NotEnoughData("the sweep is shorter than one interval; use shorter intervals")
        if self._clock is None:
            self._clock = drive_phase(data[0], self._rate_hz, low_hz=self._low_hz, high_hz=self._high_hz)
        phase = self._clock
        track = partial(track_signals, phase_rad=phase.phase_rad, interval_samples=self._interval)
        base, velocity = track((data[-2], data[-1]))
        frequency_hz = _means(phase.frequency_hz[: upper.size * self._interval], self._interval)
        omega = 2 * np.pi * frequency_hz
        noise_density = float(np.median(noise)) / np.sqrt(self._rate_hz * self._factor / 2)
        residual = impacts = linear_ii = np.full(upper.size, np.nan)
        steady_over_swept = np.nan
        if linear is not None:
            # Excite the linear specimen by order 1 only: accelerometer noise would excite modes too.
            middles = (np.arange(upper.size) + 0.5) * self._interval
            place = np.arange(data.shape[1])
            at_middles = base.order(1.0)
            cosine, sine = (np.interp(place, middles, each) for each in (at_middles.real, at_middles.imag))
            moved = whole[-2].copy()
            moved[inside] = cosine * np.cos(phase.phase_rad) - sine * np.sin(phase.phase_rad)
            (swept,) = track((self._linear_velocity(moved, linear)[inside],))
            residual, impacts = swept.residual_rms / np.abs(swept.order(1.0)), swept.impacts
            linear_ii, measured = (
                omega * np.abs(each.order(1.0) / base.order(1.0)) for each in (swept, velocity)
            )
            reached = float(np.max(linear_ii))
            if abs(float(np.max(measured)) / reached - 1) < _SAME_LARGEST:
                steady = _largest_steady(linear, frequency_hz.min(), frequency_hz.max())
                steady_over_swept = float(steady / reached)
        fundamental = ORDERS.index(1.0)
        amplitude_m = np.abs(base.order(1.0)) / omega**2
        low_hz, high_hz = self._band_hz
        displacement = converted_signal(
            whole[-1],
            self._rate_hz,
            given=Quantity.VELOCITY,
            wanted=Quantity.DISPLACEMENT,
            low_hz=low_hz,
            high_hz=high_hz,
        )
        used = count * self._interval
        intervals = displacement.samples[inside][:used].reshape(count, self._interval)
        bridged = self._bridges()[inside][:used].reshape(count, self._interval)
        clear = far_from(bridged.ravel(), round(_BRIDGE_PERIODS * self._rate_hz / low_hz)).reshape(
            bridged.shape
        )
        peak_m = np.max(np.abs(intervals), axis=1, where=clear, initial=0.0)
        peak_m[np.mean(clear, axis=1) < LEAST_CLEAR] = np.nan
        ratio = 1j * omega * velocity.order(1.0) / base.order(1.0) * np.exp(1j * omega * delay_s)
        relative = np.hypot(
            velocity.sd[fundamental] / velocity.amplitude[fundamental],
            base.sd[fundamental] / base.amplitude[fundamental],
        )
        motion = SweptMotion(
            time_s=(np.arange(count, dtype=np.float64) + 0.5) * (self._interval / self._rate_hz),
            frequency_hz=frequency_hz,
            upper=upper,
            lower=lower,
            drive_amplitude_m=amplitude_m,
            sd_drive_amplitude_m=base.sd[fundamental] / omega**2,
            velocity=velocity,
            peak_displacement_m=peak_m,
            response_i=peak_m / amplitude_m,
            response_ii=np.abs(ratio),
            sd_response_ii=np.abs(ratio) * relative,
            phase_rad=np.angle(ratio),
            noise_rms=noise_density * np.sqrt(self._rate_hz / 2),
            is_clear=np.asarray(~bridged.any(axis=1)),
            linear_residual=residual,
            linear_ii=linear_ii,
            linear_impacts=impacts,
            steady_over_swept=steady_over_swept,
            interval_s=self._interval / self._rate_hz,
        )
        return motion, intervals, data[-1], phase

    def _bridges(self) -> Flags:
        """Return flags of the decimated samples that include a bridged drop-out."""
        bridged = np.concatenate(self._bridged)
        bridged = np.append(bridged, np.zeros(-bridged.size % self._factor, dtype=np.bool_))
        return np.asarray(bridged.reshape(-1, self._factor).any(axis=1))

    def _linear_velocity(self, base: Reals, linear: Transmission) -> Reals:
        """Return the velocity [m/s] without contact due to the recorded acceleration of the base [m/s2]."""
        # Pad with zeros: otherwise ringing after the end would wrap around to the start.
        padded = fft.next_fast_len(2 * base.size, real=True)
        frequency_hz = fft.rfftfreq(padded, 1 / self._rate_hz)
        low_hz, high_hz = _BAND_BELOW * self._low_hz, _LINEAR_ABOVE * self._high_hz
        kept = np.flatnonzero((frequency_hz > low_hz) & (frequency_hz < high_hz))
        spectrum = fft.rfft(base, padded)
        spectrum[: kept[0]] = spectrum[kept[-1] + 1 :] = 0.0
        for lines in np.array_split(kept, 1 + kept.size // _LINES):
            spectrum[lines] *= linear(frequency_hz[lines]) / (2j * np.pi * frequency_hz[lines])
        return np.asarray(fft.irfft(spectrum, padded, overwrite_x=True)[: base.size])

    def _harmonics(self, response: Reals, phase: DrivePhase) -> tuple[TrackedOrders, Reals]:
        """Return displacement at `ALL_ORDERS`, in intervals long enough to separate the orders."""
        cycles = self._low_hz * self._interval / self._rate_hz
        longer = self._interval * max(1, ceil(_ROOM * cycles_needed(ALL_ORDERS) / cycles))
        longer = min(longer, response.size)
        tracked = track_orders(response, phase.phase_rad, interval_samples=longer, orders=ALL_ORDERS)
        count = tracked.residual_rms.size
        frequency_hz = _means(phase.frequency_hz[: count * longer], longer)
        omega = 2 * np.pi * frequency_hz * np.asarray(ALL_ORDERS)[:, np.newaxis]
        scaled = replace(tracked, value=tracked.value / (1j * omega), sd=tracked.sd / omega)
        return scaled, frequency_hz


def _largest_steady(linear: Transmission, low_hz: float, high_hz: float) -> float:
    """Return the largest magnitude of a transmission between two frequencies; narrow modes are not missed."""
    hz, step_hz = np.linspace(low_hz, high_hz, _STEADY_POINTS, retstep=True)
    steady = np.abs(linear(hz))
    rising = np.diff(steady) > 0
    peaks = np.flatnonzero(rising[:-1] & (steady[1:-1] > steady[2:])) + 1
    near_hz = hz[peaks, np.newaxis] + step_hz * np.linspace(-1, 1, _PEAK_POINTS)
    return float(np.max(np.append(steady, np.abs(linear(near_hz.ravel())))))


def _means(values: Reals, length: int) -> Reals:
    return np.asarray(values.reshape(-1, length).mean(axis=1))
