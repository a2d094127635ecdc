"""Analysis of a recorded dwell: its responses over the last seconds."""

from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

import numpy as np

from vibench.acquisition.plan import Dwell, HeldDwell
from vibench.acquisition.recording import SegmentLabel

from ..chaos.verdict import (
    LONGEST_PERIOD,
    MotionKind,
    MotionVerdict,
    Points,
    begin_of_last_motion,
    motion_verdict,
    shortest_period,
)
from ..errors import InvalidRequest, NotEnoughData
from ..recordings.channels import RecordedChannels, only_stretch, read_whole
from ..recordings.checks import AbstractAnalysis, Check, Verdict
from ..recordings.facts import RecordingFacts, specimen_of
from ..signals import REACH, Envelope, Flags, Quantity, Reals, converted_signal, envelope, interpolate
from ..spectra import spectral_density
from ..tables import Tabular
from ..tones import fit_sine, largest_peak
from .dwell import LOWEST_ORDER, DwellResponse, clear_of_dropouts, dwell_response, silence_before

# Whether the motion of a dwell repeats: Poincaré points, and the verdict from these points.

BAND_ABOVE = 0.25
"""Low-pass frequency relative to the sample rate; the filter ends within the band of the interpolation."""


_CLEAR_MOTION = 0.8
"""Minimum fraction of a dwell without drop-outs for the verdict that its motion does not repeat."""

BURST = 15.0
"""A maximum that deviates from the median by more than this many median deviations is a burst."""
_LEAST_RISE = 0.01
"""Smallest relative rise of |x| above its usual maximum that counts as a burst."""


@dataclass(frozen=True)
class Section:
    """Poincaré points (displacement and velocity at one phase of every drive period), and the orbit."""

    drive_hz: float
    phase_rad: float
    """Drive phase of the Poincaré points; the drive is a cosine."""
    displacement_m: Reals
    velocity_m_per_s: Reals
    """Displacement and velocity of the Poincaré points, shape (periods,)."""
    orbit_displacement_m: Reals
    orbit_velocity_m_per_s: Reals
    """Phase portrait over the periods of the Poincaré points, shape (samples,)."""
    time_s: Reals
    """Time of the Poincaré points, from the first sample of the record; shape (periods,)."""


def stroboscope(
    drive: Reals,
    response: Reals,
    sample_rate_hz: float,
    *,
    near_hz: float,
    phase_rad: float = 0.0,
    delay_s: float = 0.0,
) -> Section:
    """Return the motion at one phase of every period of the recorded drive, by interpolation.

    The nominal drive frequency is not accurate enough: 50 ppm between the clocks shift the phase by half a
    period of 100 Hz in 100 s.

    Parameters
    ----------
    drive, response
        Drive voltage and response velocity [m/s], shape (samples,).
    near_hz
        Drive frequency, within 20 %.
    phase_rad
        Phase of the points.
    delay_s
        Lag of the response channel behind the drive channel [s].
    """
    if drive.shape != response.shape:
        raise InvalidRequest(f"drive {drive.shape} and response {response.shape} must be equally long")
    sine = fit_sine(drive, sample_rate_hz, near_hz)
    converted = partial(
        converted_signal,
        response,
        sample_rate_hz,
        given=Quantity.VELOCITY,
        low_hz=LOWEST_ORDER * near_hz,
        high_hz=BAND_ABOVE * sample_rate_hz,
        lines_hz=[sine.frequency_hz],
    )
    displacement, velocity = converted(wanted=Quantity.DISPLACEMENT), converted(wanted=Quantity.VELOCITY)
    first = max(displacement.edge_samples, REACH)
    last = response.size - 1 - first
    per_sample = sine.frequency_hz / sample_rate_hz
    offset = (sine.phase_rad - phase_rad) / (2 * np.pi)
    delay = delay_s * sample_rate_hz
    turns = np.arange(
        np.ceil((first - delay) * per_sample + offset), np.floor((last - delay) * per_sample + offset) + 1
    )
    if turns.size == 0:
        raise NotEnoughData(
            f"the record of {drive.size / sample_rate_hz:g} s contains no drive period outside its disturbed "
            "ends; record longer"
        )
    positions = (turns - offset) / per_sample + delay
    inside = slice(first, last + 1)
    motion = interpolate(np.stack([displacement.samples, velocity.samples]), positions)
    return Section(
        drive_hz=sine.frequency_hz,
        phase_rad=phase_rad,
        displacement_m=motion[0],
        velocity_m_per_s=motion[1],
        orbit_displacement_m=displacement.samples[inside],
        orbit_velocity_m_per_s=velocity.samples[inside],
        time_s=positions / sample_rate_hz,
    )


@dataclass(frozen=True, eq=False)
class DwellMotion(Tabular):
    """Poincaré points of a dwell, with the verdict."""

    section: Section
    verdict: MotionVerdict


def dwell_motion(channels: RecordedChannels, response: DwellResponse) -> DwellMotion:
    """Return the Poincaré points of a dwell and the verdict on its motion.

    Raises UnusableData when samples were lost inside the dwell.
    """
    section = dwell_section(channels, response)
    verdict = motion_verdict(_points(section, response, channels.sample_rate_hz), section.drive_hz)
    stretch = only_stretch(channels, SegmentLabel.DWELL)
    bridged = channels.bridge_flags(stretch.start, stretch.stop)
    is_clear = clear_of_dropouts(bridged, channels.sample_rate_hz, section.drive_hz)
    clear = np.mean(is_clear)
    # A short burst has few points, which look like noise, and its maximum may lie outside the window.
    rise = _largest_rise(response, is_clear, verdict.evidence.periods)
    if verdict.kind is MotionKind.PERIODIC and rise > _LEAST_RISE:
        why = f"a burst raises |x| {100 * rise:.2g} % above its usual maximum; find the cause and dwell again"
        verdict = replace(verdict, kind=MotionKind.UNDECIDED, why=why, period=None)
    # Bridged drop-outs can make a repeating motion look irregular, but not the reverse.
    if clear < _CLEAR_MOTION and verdict.kind in {MotionKind.CHAOTIC, MotionKind.QUASI_PERIODIC}:
        why = (
            f"drop-outs of the vibrometer affect {100 * (1 - clear):.0f} % of the dwell, and may make the "
            f"motion look {verdict.kind.value}; refocus the laser"
        )
        verdict = replace(verdict, kind=MotionKind.UNDECIDED, why=why)
    return DwellMotion(section, verdict)


def _largest_rise(response: DwellResponse, is_clear: Flags, periods: int) -> float:
    """Return the relative rise of |x| above the median of its maxima; 0 if scatter explains the rise."""
    motion = response.displacement
    size = np.where(is_clear, np.abs(motion.samples), 0.0)[motion.edge_samples : -motion.edge_samples]
    block = round(LONGEST_PERIOD * motion.sample_rate_hz / response.drive.frequency_hz)
    blocks = min(size.size // block, periods // LONGEST_PERIOD)
    largest = np.max(size[size.size - blocks * block :].reshape(blocks, block), axis=1)
    largest = largest[largest > 0.0]
    if not largest.size:
        return 0.0
    off = largest / np.median(largest) - 1
    return float(np.max(off)) if np.max(off) > BURST * np.median(np.abs(off)) else 0.0


@dataclass(frozen=True)
class IrregularMotion:
    """Part of a dwell in which the motion did not repeat, from the first undisturbed period."""

    start_s: float
    stop_s: float
    """End of the irregular motion, from the first sample of the dwell."""
    ended: bool
    """Whether a repeating motion followed the irregular motion."""


def irregular_motion(section: Section, response: DwellResponse, rate_hz: float) -> IrregularMotion | None:
    """Return the part of a dwell in which the motion did not repeat; None if the whole motion repeats."""
    points = _points(section, response, rate_hz)
    begin = begin_of_last_motion(points)
    repeats = shortest_period(Points(points.value[begin:], points.noise)) is not None
    if repeats and begin == 0:
        return None
    start_s, stop_s = float(section.time_s[0]), float(section.time_s[begin if repeats else -1])
    return IrregularMotion(start_s, stop_s, repeats)


def dwell_section(channels: RecordedChannels, response: DwellResponse) -> Section:
    """Return the Poincaré points of a whole dwell."""
    drive, _, velocity = read_whole(channels, only_stretch(channels, SegmentLabel.DWELL))
    return stroboscope(
        drive,
        velocity,
        channels.sample_rate_hz,
        near_hz=response.drive.frequency_hz,
        delay_s=channels.response_delay_s,
    )


def _points(section: Section, response: DwellResponse, sample_rate_hz: float) -> Points:
    """Return the Poincaré points and their noise, both relative to the size of the orbit."""
    sizes = np.array(
        [
            np.sqrt(2 * np.mean(section.orbit_displacement_m**2)),
            np.sqrt(2 * np.mean(section.orbit_velocity_m_per_s**2)),
        ]
    )
    velocity_noise = response.noise_density * np.sqrt(BAND_ABOVE * sample_rate_hz)
    value = np.column_stack((section.displacement_m, section.velocity_m_per_s)) / sizes
    return Points(value, np.array([response.noise_displacement_m, velocity_noise]) / sizes)


_SEGMENT_S = 0.5
"""Segment length of the density [s]: lines 3 Hz wide, about twenty averages in 5 s."""
_REACH = 0.1
"""Half width of the band relative to its centre frequency."""


@dataclass(frozen=True)
class TerminalLevel:
    """Displacement within a band around a frequency, such as a bound mode's frequency."""

    DOCUMENT: ClassVar = "towards_hz low_hz high_hz peak_hz rms_m relative_sd decibel_re_drive_line=decibel"

    towards_hz: float
    low_hz: float
    high_hz: float
    peak_hz: float
    """Frequency of the largest displacement density in the band; may be an end of the band."""
    rms_m: float
    relative_sd: float
    decibel: float
    """RMS of the band relative to the spectral line at the drive frequency [dB]."""


def terminal_levels(response: DwellResponse, towards_hz: tuple[float, ...]) -> tuple[TerminalLevel, ...]:
    """Return the levels of bands around the given frequencies, except bands that contain the drive's line."""
    motion = response.displacement
    window = round(response.window_s * motion.sample_rate_hz)
    segment = min(round(_SEGMENT_S * motion.sample_rate_hz), window // 4)
    density = spectral_density(motion.settled[-window:], motion.sample_rate_hz, segment_samples=segment)
    line_m = float(abs(response.order_displacement[response.orders.index(1.0)])) / np.sqrt(2)
    found = []
    for target in towards_hz:
        low, high = target * (1 - _REACH), target * (1 + _REACH)
        margin = 2 * density.noise_bandwidth_hz
        if low - margin < response.drive.frequency_hz < high + margin:
            continue
        inside = np.flatnonzero((density.frequency_hz >= low) & (density.frequency_hz <= high))
        rms = density.rms(low, high)
        lines = max(1.0, (high - low) / density.noise_bandwidth_hz)
        found.append(
            TerminalLevel(
                towards_hz=target,
                low_hz=low,
                high_hz=high,
                peak_hz=float(density.frequency_hz[inside[np.argmax(density.density[inside])]]),
                rms_m=rms,
                relative_sd=float(0.5 / np.sqrt(density.n_eff * lines)),
                decibel=float(20 * np.log10(max(rms, np.finfo(float).tiny) / line_m)),
            )
        )
    return tuple(found)


DwellPlan = Dwell | HeldDwell
WINDOW_S = 5.0
"""Analysed window as in the paper: the last 5 s of a dwell."""
_DWELL_EDGE_PERIODS = 121
"""Number of drive periods that integration disturbs, sum of both ends."""
_SHORTEST_WINDOW_PERIODS = 50
_TIME_BINS = 1200
_LEAST_TURNS, _LEFT_OUT, _ABOVE_DRIFT = 10, 0.03, 30.0
"""Minima for reporting a line as left out: periods within the window, and ratios of the line's amplitude to
the largest displacement and to the noise floor, which rises towards 0 Hz."""


@dataclass(frozen=True, eq=False)
class DwellAnalysis(AbstractAnalysis[DwellPlan, DwellResponse]):
    """Analysis of a dwell: time signal, spectrum, responses and lines."""

    OWN_UNITS: ClassVar = {"displacement": "m"}
    DOCUMENT: ClassVar = "*response terminal_bands=terminal motion=motion.verdict"

    displacement: Envelope
    """x over the dwell [m], without the ends that integration disturbs."""
    terminal: tuple[TerminalLevel, ...]
    """Levels in the bands of the bound modes."""
    motion: DwellMotion
    """Poincaré points of the dwell, and the verdict on its motion."""
    irregular: IrregularMotion | None
    """Part of the dwell in which the motion did not repeat; None if the whole motion repeats."""


def bound_frequencies_hz(facts: RecordingFacts) -> tuple[float, ...]:
    """Return the natural frequencies with m1 bound to m2, which strong collisions excite."""
    return tuple(float(each) for each in specimen_of(facts.bench).bound_frequencies_hz)


def measured_dwell(
    channels: RecordedChannels, dwell: DwellPlan, towards_hz: tuple[float, ...], longest_s: float = WINDOW_S
) -> DwellResponse:
    """Analyse the last ``longest_s`` of a dwell, or all of a shorter dwell."""
    stretch = only_stretch(channels, SegmentLabel.DWELL)
    drive, base, response = read_whole(channels, stretch)
    rate = channels.sample_rate_hz
    clear_s = stretch.samples / rate - _DWELL_EDGE_PERIODS / dwell.frequency_hz
    if clear_s < _SHORTEST_WINDOW_PERIODS / dwell.frequency_hz:
        raise NotEnoughData(
            f"{stretch.samples / rate:.3g} s of the dwell were recorded; without the ends, which integration "
            f"disturbs, too little remains at {dwell.frequency_hz:g} Hz: measure longer"
        )
    return dwell_response(
        drive,
        base,
        response,
        rate,
        near_hz=dwell.frequency_hz,
        window_s=min(longest_s, clear_s),
        towards_hz=towards_hz,
        delay_s=channels.response_delay_s,
        sensors=complex(channels.response_gain(np.array([dwell.frequency_hz]))[0]),
        silence=silence_before(channels)[-1],
        bridged=channels.bridge_flags(stretch.start, stretch.stop),
    )


def slow_line_check(found: DwellResponse) -> tuple[Check, ...]:
    """Warn of a line below the band of the displacement, such as a subharmonic of high order."""
    low_hz, first_hz = found.displacement.low_hz, _LEAST_TURNS / found.window_s
    peak = largest_peak(found.spectrum, first_hz, low_hz) if first_hz < 0.5 * low_hz else None
    least_m = _LEFT_OUT * found.response_i * found.drive.amplitude_m
    if peak is None or peak.amplitude < max(least_m, _ABOVE_DRIFT * peak.floor):
        return ()
    text = (
        f"motion at {peak.frequency_hz:.2g} Hz, with an amplitude of {peak.amplitude:.3g} m, is left out of "
        f"Response I and of the verdict, which include frequencies above {low_hz:g} Hz"
    )
    return (Check("Slow motion", Verdict.WARNING, text),)


def settled_envelope(response: DwellResponse) -> Envelope:
    """Return the envelope of x over the dwell, for plots."""
    motion = response.displacement
    start_s = motion.edge_samples / motion.sample_rate_hz
    return envelope(motion.settled, motion.sample_rate_hz, bins=_TIME_BINS, start_s=start_s)


_HIGHEST_ORDER = 2.4
"""Upper end of a shown spectrum relative to the drive frequency."""
COLUMN_HZ = 1.0
"""Width of a column [Hz]; only its largest spectral line is drawn, because a figure has no more pixels."""


def spectrum_columns(response: DwellResponse) -> tuple[Reals, Reals]:
    """Return centre [Hz] and largest amplitude, divided by A0, of each column of the spectrum."""
    spectrum = response.spectrum
    width = max(1, round(COLUMN_HZ / spectrum.spacing_hz))
    first = max(1, round(5.0 / spectrum.spacing_hz))
    last = round(_HIGHEST_ORDER * response.drive.frequency_hz / spectrum.spacing_hz)
    starts = np.arange(first, last, width)
    largest = np.maximum.reduceat(spectrum.amplitude[:last], starts)
    middle: Reals = np.asarray((starts + 0.5 * (width - 1)) * spectrum.spacing_hz, dtype=np.float64)
    return middle, largest / response.drive.amplitude_m
