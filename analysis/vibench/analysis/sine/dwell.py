"""Results of a dwell at one frequency: Responses I and II, spectrum, lines and noise."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from vibench.acquisition.plan import CHECK_QUIET_S
from vibench.acquisition.recording import SegmentLabel

from .. import tones
from ..chaos.verdict import LARGEST_NOISE, SMALL, STEADY
from ..errors import InvalidRequest, NotEnoughData, UnusableData
from ..recordings.channels import RecordedChannels, far_from
from ..signals import (
    Complexes,
    ConvertedSignal,
    Flags,
    Quantity,
    Reals,
    converted_signal,
    disturbed_samples,
    sizes_with_maxima,
    standard_uncertainty,
)
from ..spectra import AmplitudeSpectrum, amplitude_spectrum, spectral_density
from ..tables import Tabular

NOTHING: Reals = np.empty(0)
_EXPLAINED = 1.5
"""Largest ratio of residual motion to vibrometer noise at which the residual counts as noise."""
_SILENT = 3.0
"""Largest residual that counts as noise, relative to the noise in a silence shorter than a ring-down."""
OVERHEARD = 20.0
"""Largest ratio of the residual to the noise in the silence at which the residual may be noise.

By chance, a mode excited by noise is this weak in one of 400 short silences. A silence also contains no noise
of the generator.
"""
BETWEEN = "residual of the motion between its spectral lines"


@dataclass(frozen=True)
class Background:
    """Noise in a window of displacement."""

    rms_m: float
    """RMS of the noise; NaN if it cannot be distinguished from motion."""
    frequency_hz: float
    """Rms frequency of the noise; a window has two independent noise values per cycle of this frequency."""
    source: str
    """Source of the noise estimate, or the reason why there is none."""

    @property
    def is_known(self) -> bool:
        """Return whether the noise of the displacement is known."""
        return bool(np.isfinite(self.rms_m))


def silence_before(channels: RecordedChannels) -> Reals:
    """Return all channels in the silence of the bench check; empty if samples were lost or not recorded."""
    for stretch in channels.stretches(SegmentLabel.CHECK):
        stop = stretch.start + round(CHECK_QUIET_S * channels.sample_rate_hz)
        heard = channels.read(stretch.start, min(stop, stretch.stop))
        return heard if np.isfinite(heard).all() else heard[:, :0]
    return np.empty((3, 0))


def background_in_silence(velocity: Reals, band_hz: tuple[float, float], rate_hz: float) -> Background:
    """Return the displacement noise of a silence in a band; NaN if the silence is too short for the band."""
    source = "silence before the check"
    if 2 * velocity.size < rate_hz / band_hz[0]:
        return Background(np.nan, np.nan, source)
    found = spectral_density(velocity - velocity.mean(), rate_hz, segment_samples=velocity.size)
    inside = (found.frequency_hz >= band_hz[0]) & (found.frequency_hz <= band_hz[1])
    omega = 2 * np.pi * found.frequency_hz[inside]
    fast, slow = (float(np.sum(found.density[inside] / omega**power)) for power in (0, 2))
    rms_m = np.sqrt(slow * (found.frequency_hz[1] - found.frequency_hz[0]))
    return Background(float(rms_m), float(np.sqrt(fast / slow) / (2 * np.pi)) if slow else 0.0, source)


def background_between_lines(rest: Reals, rate_hz: float) -> Background:
    """Return the noise of a displacement after removing everything that repeats with the drive."""
    rms_m = float(np.std(rest))
    turns = float(np.std(np.diff(rest))) * rate_hz / (2 * np.pi)
    return Background(rms_m, turns / rms_m if rms_m else 0.0, BETWEEN)


def background_of(rest: Background, motion_m: float, sensor: Background, silent: Background) -> Background:
    """Return the noise in the non-repeating part of a motion.

    The non-repeating part, or residual between the lines, may be noise or chaos. It counts as noise if
    vibrometer noise or noise in the silence explains it, or if it is negligible for a periodic motion.
    Otherwise the noise comes from the silence or the vibrometer; without a silence it is unknown.

    Parameters
    ----------
    rest
        The residual between the lines.
    motion_m
        RMS of the whole motion.
    sensor
        Vibrometer noise, assumed white.
    silent
        Noise in the silence before the test.
    """
    heard_m = silent.rms_m if silent.is_known else 0.0
    if rest.rms_m <= max(_EXPLAINED * sensor.rms_m, _SILENT * heard_m, SMALL * motion_m):
        return rest
    if silent.is_known:
        return larger_noise(silent, sensor)
    return Background(
        np.nan,
        np.nan,
        f"{100 * rest.rms_m / motion_m:.2g} % of the motion does not repeat. Noise and motion cannot be "
        "distinguished, because no silence was recorded before the test; measure with the bench check",
    )


def larger_noise(silent: Background, sensor: Background) -> Background:
    """Return the larger of the noise in the silence and the sensor noise."""
    return silent if silent.rms_m > sensor.rms_m else sensor


_BLOCKS_OF_WINDOW = 10
_LEAST_CYCLES = 4.0
"""Minimum number of drive cycles in a block, so that its Hann window excludes other orders."""
_FEWEST_BLOCKS = 4
_SLOW = 0.5
"""Largest correlation of neighbouring random blocks; 1 % of records of ten random blocks exceed it."""
_ONCE = 0.5
"""If more than this fraction of the variance has one cycle per record, the response may still be changing."""
_TREND, _CLEAR_TREND = 2.0, 8.0
"""Squared trend / its variance: below the first value it is random, above the second it is a slow change.

By chance, 14 % of records exceed the first value, and 0.4 % exceed the second.
"""
_BEYOND = 3.0
"""Minimum ratio of the remaining decay to the observed scatter."""
_LONGEST_DECAY = 10.0
"""Longest time constant of a decay that the bounds include, in lengths of the record."""


def slow_change(parts: Complexes | Reals) -> float:
    """Return the relative standard uncertainty that slow change adds to a mean or maximum.

    Returns 0 if the parts scatter at random, because their standard error then suffices. A change that may
    continue after the record counts as an exponential decay; the curvature of the parts limits its time
    constant. Returns NaN if a change of more than 0.6 % may remain, because the final value is then unknown.

    Parameters
    ----------
    parts
        Amplitudes of successive equal parts of a record, shape (parts,).
    """
    count = parts.size
    off = parts / np.mean(parts) - 1
    power = float(np.sum(np.abs(off) ** 2))
    if count < _FEWEST_BLOCKS or power == 0.0:
        return 0.0
    # The fewer the parts, the less correlated are neighbouring parts of a linear trend.
    limit = _SLOW * (1 - 3 / count) / (1 - 3 / _BLOCKS_OF_WINDOW)
    is_slow = float(np.sum(np.real(off[1:] * np.conj(off[:-1])))) > min(limit, _SLOW) * power
    place = (2 * np.arange(count) + 1) / count - 1
    slope = complex(place @ off / (place @ place))
    trend = abs(slope) ** 2 * float(place @ place)
    scatter = (power - trend) / (count - 2)
    if trend <= _CLEAR_TREND * scatter:
        if not is_slow:
            return float(np.sqrt(max(0.0, trend - _TREND * scatter) / (place @ place)))
        lines = np.abs(np.fft.fft(off)) ** 2
        if lines[1] + lines[-1] <= _ONCE * np.sum(lines):
            return float(np.sqrt(power / (count - 1)))
    least = _BEYOND * float(np.sqrt(power / (count - 1)))
    remaining = max(least, 0.6 * _remaining_decay(off, slope, place))
    return remaining if remaining <= _BEYOND * STEADY else float("nan")


def _remaining_decay(off: Complexes | Reals, slope: complex, place: Reals) -> float:
    """Return the largest likely distance of the mean of ``off`` from the limit of its exponential decay.

    For exp(-h x), -1 < x < 1, the ratio of quadratic to linear Legendre coefficient is r = (5/3) i2(h) /
    i1(h), at most h / 3. The ratio of the mean to the linear coefficient is 0.2 r + 1 / h.
    """
    curve = place**2 - np.mean(place**2)
    bend = complex(curve @ off / (curve @ curve))
    rest = float(np.sum(np.abs(off - slope * place - bend * curve) ** 2)) / (place.size - 3)
    sd = float(np.sqrt(rest / (2 * (curve @ curve))))
    ratio = -2 / 3 * ((bend / slope).real + 2 * sd / abs(slope))
    ratio = max(ratio, 1 / (6 * _LONGEST_DECAY))
    return float(abs(slope) * (0.2 * ratio + 1 / (3 * ratio)))


def demodulate(samples: Reals, cycles_per_sample: float, window_samples: int) -> Complexes:
    """Return the complex amplitude at the drive frequency in ten equal blocks of the window."""
    block = max(window_samples // _BLOCKS_OF_WINDOW, round(_LEAST_CYCLES / cycles_per_sample))
    taper = np.hanning(block)
    taper *= 2 / np.sum(taper)
    places = np.arange(block)
    turn = taper * np.exp(-2j * np.pi * cycles_per_sample * places)
    starts = np.arange(0, samples.size - block + 1, block)
    return np.array(
        [
            np.sum(turn * samples[first : first + block])
            * np.exp(-2j * np.pi * ((cycles_per_sample * first) % 1.0))
            for first in starts
        ]
    )


LOWEST_ORDER = 0.1
"""High-pass frequency for displacement, relative to the drive frequency; above drift and hum."""
_BAND_ABOVE = 0.33
"""Low-pass frequency for displacement, relative to the sample rate."""
_SCATTER_BLOCKS = 10
_NOISE_BAND = (0.2, 0.4)
"""Band, relative to the sample rate, that contains only vibrometer noise, above modes and impacts."""
_NOISE_SEGMENT = 4096
LEAST_CLEAR = 0.2
"""Minimum fraction of a window that must be free of drop-outs."""
_NONE: Flags = np.zeros(0, dtype=np.bool_)


@dataclass(frozen=True)
class Line:
    """One spectral line of a displacement."""

    DOCUMENT: ClassVar = "label frequency_hz amplitude_m sd_amplitude_m decibel_re_drive_line=decibel"

    label: str
    """``"order 1"``, ``"order 3/2"``, ``"peak towards 201 Hz"``."""
    frequency_hz: float
    amplitude_m: float
    sd_amplitude_m: float
    """Uncertainty: for orders, scatter over tenths of the window; for peaks, noise floor of the spectrum."""
    decibel: float
    """Level of the line relative to the spectral line at the drive frequency."""


@dataclass(frozen=True)
class DwellResponse(Tabular):
    """Results of one dwell over its analysed window."""

    OWN_UNITS: ClassVar = {
        "order_displacement": "m",
        "noise_density": "m s-1 Hz-0.5",
        "displacement": "m",
        "spectrum": "m",
    }
    DOCUMENT: ClassVar = (
        "frequency_hz=drive.frequency_hz sd_frequency_hz=drive.sd_frequency_hz "
        "drive_amplitude_m=drive.amplitude_m sd_drive_amplitude_m=drive.sd_amplitude_m "
        "drive_distortion=drive.distortion window_s response_i noise_bias_i noise_error_i noise_source "
        "response_ii sd_response_ii slow_change phase_rad sd_phase_rad lines"
    )

    drive: tones.DriveLevel
    window_s: float
    response_i: float
    """Largest |x| over the window, divided by the drive amplitude."""
    noise_bias_i: float
    """Expected bias of Response I due to noise; NaN if the noise is unknown."""
    noise_error_i: float
    """RMS error of Response I due to noise, including the bias; NaN if the noise is unknown."""
    noise_source: str
    """Source of the noise estimate, or the reason why the noise is unknown."""
    rest_bias_i: float
    """Bias of Response I if the whole non-repeating part is noise; NaN if this part is too large."""
    rest_error_i: float
    rest_displacement_m: float
    """RMS of the part of the displacement that does not repeat with the drive [m]."""
    response_ii: float
    """Amplitude of x at the drive frequency, divided by the drive amplitude."""
    sd_response_ii: float
    """Standard deviation of Response II; NaN if the response still changes by an unknown amount."""
    slow_change: float
    """Relative standard uncertainty of Response I due to slow change of base or response; NaN if unknown."""
    phase_rad: float
    """Phase lead of x over the base displacement at the drive frequency, without the channels' delay."""
    sd_phase_rad: float
    orders: tuple[float, ...]
    order_displacement: Complexes
    """Complex amplitudes of x at the orders [m]; phases relative to the drive voltage as a cosine."""
    noise_density: float
    """Noise density of the velocity channel [m/s per root hertz]."""
    noise_displacement_m: float
    """RMS displacement noise [m]: from the velocity noise or, if larger, as measured without drive."""
    displacement: ConvertedSignal
    """x over the record [m]; the window lies in the settled part."""
    is_clear: Flags
    """Flags of the window's samples that no drop-out affects, shape (samples,)."""
    spectrum: AmplitudeSpectrum
    """Spectrum of x over the window [m]."""
    lines: tuple[Line, ...]

    def with_rest_as_noise(self, *, is_known_to_repeat: bool) -> Self:
        """Return a copy that counts the non-repeating part as noise, for motions not known to be irregular.

        If the motion is not known to repeat either, this part counts as noise only if it is at most
        `OVERHEARD` times the known noise.
        """
        heard_m = self.noise_displacement_m
        if not (is_known_to_repeat or self.rest_displacement_m <= OVERHEARD * heard_m):
            return self
        if np.isnan(self.rest_error_i) or self.rest_error_i <= self.noise_error_i:
            return self
        return replace(
            self, noise_bias_i=self.rest_bias_i, noise_error_i=self.rest_error_i, noise_source=BETWEEN
        )


def dwell_response(
    drive: Reals,
    base: Reals,
    response: Reals,
    sample_rate_hz: float,
    *,
    near_hz: float,
    window_s: float = 5.0,
    towards_hz: tuple[float, ...] = (),
    orders: tuple[float, ...] = tones.ALL_ORDERS,
    delay_s: float = 0.0,
    sensors: complex = 1.0,
    silence: Reals = NOTHING,
    bridged: Flags = _NONE,
) -> DwellResponse:
    """Analyse the last seconds of a dwell.

    Raises NotEnoughData when the record without its disturbed ends is shorter than the window, and
    UnusableData when the drive channel has no sine near ``near_hz``.

    Parameters
    ----------
    drive, base, response
        Drive voltage, base acceleration [m/s2], response velocity [m/s], shape (samples,). Pass more than
        the window if possible: integration disturbs about 0.25 s at each end.
    near_hz
        Expected drive frequency, within 20 %; the exact frequency is measured.
    window_s
        Length of the window, which ends with the settled part of the displacement [s].
    towards_hz
        Frequencies, for example of the bound modes [Hz]; the largest peak within 10 % of each is listed.
    delay_s
        Lag of the response channel behind the base channel [s].
    sensors
        Gain ratio of the response sensor to the base sensor at the drive frequency, without delays.
    silence
        Response velocity in the silence before the test, if recorded [m/s].
    bridged
        Whether each sample of the response bridges a drop-out; empty if there is none.
    """
    window = _window(
        response.size, disturbed_samples(sample_rate_hz, LOWEST_ORDER * near_hz), sample_rate_hz, window_s
    )
    level = tones.drive_level(drive[window], base[window], sample_rate_hz, near_hz=near_hz)
    if level.frequency_hz > _BAND_ABOVE * sample_rate_hz:
        raise UnusableData(
            f"{sample_rate_hz:.6g} samples/s are too few for a sine at {level.frequency_hz:.6g} Hz; at least "
            f"{1 / _BAND_ABOVE:.2g} samples per period are needed: record with a higher sample rate"
        )
    highest = tones.HIGHEST_ORDER * sample_rate_hz / level.frequency_hz
    orders = tuple(order for order in orders if order <= highest)
    displacement = converted_signal(
        response,
        sample_rate_hz,
        given=Quantity.VELOCITY,
        wanted=Quantity.DISPLACEMENT,
        low_hz=LOWEST_ORDER * near_hz,
        high_hz=_BAND_ABOVE * sample_rate_hz,
        lines_hz=[order * level.frequency_hz for order in orders],
    )
    is_clear = _clear(bridged, displacement, near_hz, window)
    phase = tones.steady_phase(base[window].size, level.frequency_hz / sample_rate_hz, level.phase_rad)
    motion = displacement.samples[window]
    whole, base_whole, repeating = tones.track_signals(
        (response[window], base[window], motion), phase, interval_samples=motion.size, orders=orders
    )
    # Fit tenths of the window; in a short window, fewer parts. The scatter of the parts includes all changes.
    cycles = float(phase[-1] - phase[0]) / (2 * np.pi)
    blocks = max(2, min(_SCATTER_BLOCKS, int(cycles / (1.05 * tones.cycles_needed(orders)))))
    parts, base_parts = tones.track_signals(
        (response[window], base[window]), phase, interval_samples=phase.size // blocks, orders=orders
    )
    omega = 2 * np.pi * level.frequency_hz
    turn = 1j * omega * np.exp(1j * omega * delay_s) / sensors
    ratio = complex(turn * whole.order(1.0)[0] / base_whole.order(1.0)[0])
    each = turn * parts.order(1.0) / base_parts.order(1.0) / ratio
    base_change, change = _slow_changes(base, response, displacement, level.frequency_hz, window_s)
    scatter = float(np.hypot(standard_uncertainty(each), change))
    of_base_m = float(np.hypot(level.sd_amplitude_m, base_change * level.amplitude_m))
    level = replace(level, sd_amplitude_m=of_base_m)
    noise_density, sensor = _sensor_noise(response, displacement)
    silent = background_in_silence(silence, (displacement.low_hz, displacement.high_hz), sample_rate_hz)
    repeated = np.asarray(np.real(repeating.value[:, 0] @ np.stack(tones.order_turns(phase, orders))))
    rest = background_between_lines(motion - repeated, sample_rate_hz)
    noise = background_of(rest, float(np.std(motion)), sensor, silent)
    most_m = max(LARGEST_NOISE * float(np.std(motion)), OVERHEARD * larger_noise(silent, sensor).rms_m)
    rest_m = rest.rms_m if rest.rms_m <= most_m else np.nan
    repeated = sizes_with_maxima(repeated)
    rest_lift = tones.noise_lift(repeated, rest_m, 2 * rest.frequency_hz * window_s)
    # If the non-repeating part is only noise, the motion equals the repeating part.
    moved = repeated if noise.source == BETWEEN else motion
    lift = tones.noise_lift(moved, noise.rms_m, 2 * noise.frequency_hz * window_s)
    spectrum = amplitude_spectrum(response[window], sample_rate_hz)
    spectrum = spectrum.convert(Quantity.VELOCITY, Quantity.DISPLACEMENT)
    return DwellResponse(
        drive=level,
        window_s=window_s,
        # Do not interpolate beyond the window: the signal there may be a copy that does not join smoothly.
        response_i=float(np.max(sizes_with_maxima(motion)[is_clear])) / level.amplitude_m,
        noise_bias_i=lift.bias / level.amplitude_m,
        noise_error_i=lift.error / level.amplitude_m,
        noise_source=noise.source,
        rest_bias_i=rest_lift.bias / level.amplitude_m,
        rest_error_i=rest_lift.error / level.amplitude_m,
        rest_displacement_m=rest.rms_m,
        response_ii=abs(ratio),
        sd_response_ii=abs(ratio) * scatter,
        slow_change=float(np.hypot(change, base_change)),
        phase_rad=float(np.angle(ratio)),
        sd_phase_rad=scatter,
        orders=orders,
        order_displacement=whole.value[:, 0] / (1j * omega * np.asarray(orders)),
        noise_density=noise_density,
        noise_displacement_m=larger_noise(silent, sensor).rms_m,
        displacement=displacement,
        is_clear=is_clear,
        spectrum=spectrum,
        lines=tuple(_lines(whole, parts, level.frequency_hz, spectrum, towards_hz)),
    )


def _window(samples: int, edge: int, sample_rate_hz: float, window_s: float) -> slice:
    length = round(window_s * sample_rate_hz)
    stop = samples - edge
    if length < 1:
        raise InvalidRequest(f"window_s is {window_s:g}; it must be more than 0")
    if stop - length < edge:
        have_s = max(0, stop - edge) / sample_rate_hz
        raise NotEnoughData(
            f"a window of {window_s:g} s was requested, but only {have_s:.3g} s remain without the ends, "
            f"which integration disturbs; request a shorter window or record longer"
        )
    return slice(stop - length, stop)


def clear_of_dropouts(bridged: Flags, sample_rate_hz: float, near_hz: float) -> Flags:
    """Return flags of samples more than one period of the high-pass away from bridged drop-outs."""
    return far_from(bridged, round(sample_rate_hz / (LOWEST_ORDER * near_hz)))


def _clear(bridged: Flags, displacement: ConvertedSignal, near_hz: float, window: slice) -> Flags:
    """Return flags of window samples unaffected by drop-outs; raises UnusableData if there are too few."""
    if not bridged.any():
        return np.ones(window.stop - window.start, dtype=np.bool_)
    clear = clear_of_dropouts(bridged, displacement.sample_rate_hz, near_hz)[window]
    if np.mean(clear) < LEAST_CLEAR:
        raise UnusableData(
            f"the vibrometer lost its signal too often: {100 * np.mean(clear):.0f} % of the window is "
            f"without drop-outs, but {100 * LEAST_CLEAR:.0f} % is needed; refocus the laser and measure again"
        )
    return clear


def _slow_changes(
    base: Reals, response: Reals, displacement: ConvertedSignal, drive_hz: float, window_s: float
) -> tuple[float, float]:
    """Return the relative uncertainties due to slow change of the base, and of the ratio response / base."""
    settled = slice(displacement.edge_samples, response.size - displacement.edge_samples)
    rate = displacement.sample_rate_hz
    moved, shook = (
        demodulate(each[settled], drive_hz / rate, round(window_s * rate)) for each in (response, base)
    )
    return slow_change(np.abs(shook)), slow_change(moved / shook)


def _sensor_noise(response: Reals, displacement: ConvertedSignal) -> tuple[float, Background]:
    """Return the velocity noise density, from a band with noise only, and the displacement noise."""
    rate = displacement.sample_rate_hz
    density = spectral_density(response, rate, segment_samples=min(_NOISE_SEGMENT, response.size // 2))
    quiet = (density.frequency_hz > _NOISE_BAND[0] * rate) & (density.frequency_hz < _NOISE_BAND[1] * rate)
    level = float(np.sqrt(np.median(density.density[quiet])))
    low, high = displacement.low_hz, displacement.high_hz
    # Integrated white velocity noise has a density ~ 1/f^2 and the rms frequency sqrt(low high).
    rms_m = level / (2 * np.pi) * np.sqrt(1 / low - 1 / high)
    return level, Background(float(rms_m), float(np.sqrt(low * high)), "velocity channel")


def _lines(
    whole: tones.TrackedOrders,
    parts: tones.TrackedOrders,
    drive_hz: float,
    spectrum: AmplitudeSpectrum,
    towards_hz: tuple[float, ...],
) -> Iterator[Line]:
    """Yield the lines at the orders of the drive, and the largest peak near each of some frequencies."""
    reference = abs(whole.order(1.0)[0])
    for index, order in enumerate(whole.orders):
        omega = 2 * np.pi * drive_hz * order
        size = float(whole.amplitude[index, 0])
        spread = standard_uncertainty(parts.value[index])
        level = _decibel(size / order, reference)
        yield Line(tones.order_label(order), drive_hz * order, size / omega, spread / omega, level)
    for target in towards_hz:
        if (peak := tones.largest_peak(spectrum, 0.9 * target, 1.1 * target)) is not None:
            level = _decibel(peak.amplitude, reference / (2 * np.pi * drive_hz))
            yield Line(f"peak towards {target:g} Hz", peak.frequency_hz, peak.amplitude, peak.floor, level)


def _decibel(amplitude: float, reference: float) -> float:
    with np.errstate(divide="ignore"):
        return float(20 * np.log10(amplitude / reference))
