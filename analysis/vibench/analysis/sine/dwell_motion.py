"""How the motion of a dwell repeats: its points at the drive's phase, and the verdict on them.

The motion once per drive period: Poincare points, and the orbit they lie on.
"""

from dataclasses import dataclass, replace

import numpy as np

from vibench.acquisition.recording import SegmentLabel

from ..chaos.period import Points, shortest_period
from ..chaos.verdict import MotionKind, MotionVerdict, begin_of_last_motion, motion_verdict
from ..errors import InvalidRequest, NotEnoughData
from ..recordings.channels import Channels, only_stretch, read_whole
from ..signals.arrays import Reals
from ..signals.interpolation import REACH, interpolated
from ..signals.quantity import Quantity, converted_signal
from ..tables import Labelled
from ..tones.sine_fit import fitted_sine
from .dwell import DwellResponse, clear_of_dropouts

_LOWEST_ORDER = 0.1
"""Both signals are kept down to this part of the drive frequency."""
BAND_ABOVE = 0.25
"""... and up to this part of the sample rate, whose cosine edge ends within what interpolation trusts."""


_CLEAR_MOTION = 0.8
"""Part of a dwell that must lie clear of drop-outs where its motion does not repeat."""


@dataclass(frozen=True)
class Section:
    """Displacement and velocity at one phase of every drive period, and between."""

    drive_hz: float
    phase_rad: float
    """Drive phase at which the points were taken; the drive is a cosine."""
    displacement_m: Reals
    velocity_m_per_s: Reals
    """Shape (periods,)."""
    orbit_displacement_m: Reals
    orbit_velocity_m_per_s: Reals
    """The phase portrait: shape (samples,), over the same stretch."""
    time_s: Reals
    """Of the points, from the first sample of the record; shape (periods,)."""
    sd_timing_s: float
    """How far the phase clock may be off at the ends of the record."""


def stroboscope(
    drive: Reals,
    response: Reals,
    sample_rate_hz: float,
    *,
    near_hz: float,
    phase_rad: float = 0.0,
    delay_s: float = 0.0,
) -> Section:
    """Sample the motion at one phase of the recorded drive, between its samples.

    A nominal drive frequency would not do: 50 ppm between the clocks slide by half a period of 100 Hz
    in 100 s and smear the points.

    Parameters
    ----------
    drive, response
        Drive voltage and response velocity [m/s], shape (samples,).
    near_hz
        Drive frequency, within 20 %.
    phase_rad
        Where in the period to look.
    delay_s
        By how much the response channel lags the drive channel [s].

    """
    if drive.shape != response.shape:
        raise InvalidRequest(f"drive {drive.shape} and response {response.shape} must be equally long")
    sine = fitted_sine(drive, sample_rate_hz, near_hz)
    band = {"low_hz": _LOWEST_ORDER * near_hz, "high_hz": BAND_ABOVE * sample_rate_hz}
    displacement = converted_signal(
        response, sample_rate_hz, given=Quantity.VELOCITY, wanted=Quantity.DISPLACEMENT, **band
    )
    velocity = converted_signal(
        response, sample_rate_hz, given=Quantity.VELOCITY, wanted=Quantity.VELOCITY, **band
    )
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
            f"the record of {drive.size / sample_rate_hz:g} s holds no drive period clear of its ends; "
            "record longer"
        )
    positions = (turns - offset) / per_sample + delay
    inside = slice(first, last + 1)
    motion = interpolated(np.stack([displacement.samples, velocity.samples]), positions)
    return Section(
        drive_hz=sine.frequency_hz,
        phase_rad=phase_rad,
        displacement_m=motion[0],
        velocity_m_per_s=motion[1],
        orbit_displacement_m=displacement.samples[inside],
        orbit_velocity_m_per_s=velocity.samples[inside],
        time_s=positions / sample_rate_hz,
        sd_timing_s=sine.sd_phase_rad / (2 * np.pi * sine.frequency_hz),
    )


@dataclass(frozen=True, eq=False)
class DwellMotion(Labelled):
    """A dwell once a drive period."""

    section: Section
    verdict: MotionVerdict


def dwell_motion(channels: Channels, response: DwellResponse) -> DwellMotion:
    """Sample a dwell at the phase of its recorded drive and judge how it repeats.

    Raises UnusableData when samples were lost inside the dwell.
    """
    section = _section(channels, response)
    verdict = motion_verdict(_points(section, response, channels.sample_rate_hz), section.drive_hz)
    stretch = only_stretch(channels, SegmentLabel.DWELL)
    bridged = channels.bridged(stretch.start, stretch.stop)
    clear = np.mean(clear_of_dropouts(bridged, channels.sample_rate_hz, section.drive_hz))
    # Bridges make no motion repeat, but one that repeats irregular.
    if clear < _CLEAR_MOTION and verdict.kind in {MotionKind.CHAOTIC, MotionKind.QUASI_PERIODIC}:
        why = (
            f"drop-outs of the vibrometer affect {100 * (1 - clear):.0f} % of the dwell, and may make it "
            f"look {verdict.kind.value}; refocus the laser"
        )
        verdict = replace(verdict, kind=MotionKind.UNDECIDED, why=why)
    return DwellMotion(section, verdict)


@dataclass(frozen=True)
class IrregularMotion:
    """Motion of a dwell that does not repeat, from the dwell's first clear period on."""

    start_s: float
    stop_s: float
    """From the dwell's first sample."""
    ended: bool
    """Whether a motion that repeats followed it."""


def irregular_motion(channels: Channels, response: DwellResponse) -> IrregularMotion | None:
    """Say how long the motion of a dwell did not repeat; None where all of it does."""
    section = _section(channels, response)
    points = _points(section, response, channels.sample_rate_hz)
    begin = begin_of_last_motion(points)
    last = Points(points.value[begin:], points.noise)
    repeats = shortest_period(last) is not None
    if repeats and begin == 0:
        return None
    start_s, stop_s = float(section.time_s[0]), float(section.time_s[begin if repeats else -1])
    return IrregularMotion(start_s, stop_s, repeats)


def _section(channels: Channels, response: DwellResponse) -> Section:
    stretch = only_stretch(channels, SegmentLabel.DWELL)
    drive, _, velocity = read_whole(channels, stretch)
    return stroboscope(
        drive,
        velocity,
        channels.sample_rate_hz,
        near_hz=response.drive.frequency_hz,
        delay_s=channels.response_delay_s,
    )


def _points(section: Section, response: DwellResponse, sample_rate_hz: float) -> Points:
    """Points over the size of the orbit, and the noise in the same measure."""
    sizes = np.array(
        [
            np.sqrt(2 * np.mean(section.orbit_displacement_m**2)),
            np.sqrt(2 * np.mean(section.orbit_velocity_m_per_s**2)),
        ]
    )
    velocity_noise = response.noise_density * np.sqrt(BAND_ABOVE * sample_rate_hz)
    value = np.column_stack((section.displacement_m, section.velocity_m_per_s)) / sizes
    return Points(value, np.array([response.noise_displacement_m, velocity_noise]) / sizes)
