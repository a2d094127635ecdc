"""Simulate a specimen driven by the recorded base motion; the result has the interface of a recording.

The base displacement is computed from the recorded acceleration.
"""

from dataclasses import dataclass

import numpy as np

from vibench.acquisition.plan import Measurement
from vibench.acquisition.recording import Recording
from vibench.sim import Accuracy, Sampled, Specimen, follow_samples

from ..errors import UnusableData
from ..recordings.channels import BASE, DRIVE, RecordedChannels
from ..signals import Complexes, Integers, Quantity, Reals, Samples, converted_signal

_LOWEST_PART = 0.25
"""High-pass frequency relative to the lowest drive frequency; prevents drift by double integration."""
_HIGHEST_PART = 0.33
"""Low-pass frequency relative to the sample rate, within the converter's pass band."""


def recorded_base_motion(recording: Recording, measurement: Measurement) -> Reals:
    """Return the base displacement: the recorded acceleration, integrated twice in the frequency domain.

    The displacement has no mean and no drift, and the accelerometer channel's delay is corrected; shape
    (samples,) [m]. The whole recording is used, because it starts and ends in silence. Raises UnusableData
    when samples were lost.
    """
    acceleration = recording.read(BASE)
    lost = int(np.count_nonzero(np.isnan(acceleration)))
    if lost:
        raise UnusableData(
            f"{lost} samples of the base's acceleration were lost, so the base displacement is unknown and "
            "the motion cannot be simulated; the measured result remains valid"
        )
    rate = recording.sample_rate_hz
    low_hz, high_hz = base_band_hz(recording, measurement)
    displacement = converted_signal(
        acceleration,
        rate,
        given=Quantity.ACCELERATION,
        wanted=Quantity.DISPLACEMENT,
        low_hz=low_hz,
        high_hz=high_hz,
    )
    return advance(displacement.samples, recording.channel(BASE).delay_s * rate)


def base_band_hz(recording: Recording, measurement: Measurement) -> tuple[float, float]:
    """Return the ends of the frequency band that the base displacement contains [Hz]."""
    return _LOWEST_PART * lowest_frequency_hz(measurement), _HIGHEST_PART * recording.sample_rate_hz


def lowest_frequency_hz(measurement: Measurement) -> float:
    """Return the lowest drive frequency of a plan, excluding its bench check [Hz]."""
    plan = measurement.excitation.model_dump()
    named = [plan[key] for key in ("band_start_hz", "start_hz", "stop_hz", "frequency_hz") if key in plan]
    grid = plan.get("grid") or {}
    named += [grid["start_hz"]] if grid else []
    return float(min([*named, *(plan.get("frequencies_hz") or ())]))


def advance(samples: Reals, by_samples: float) -> Reals:
    """Advance a signal by a whole or fractional number of samples, via the phase of its spectrum."""
    if by_samples == 0.0:
        return samples
    spectrum = np.fft.rfft(samples)
    spectrum *= np.exp(2j * np.pi * np.fft.rfftfreq(samples.size) * by_samples)
    return np.asarray(np.fft.irfft(spectrum, samples.size))


_PIECE_S = 5.0
"""Duration of a piece that is simulated at once [s], to limit memory."""
_OVERLAP = 48
"""Number of extra samples on each side of a piece; each one multiplies the spline's end effect by 0.27."""
_VX = 3
_STATE = 6


@dataclass(frozen=True, eq=False, kw_only=True)
class SimulatedChannels(RecordedChannels):
    """A simulated draw with the drive, parts and flags of a recording, so that estimators accept it."""

    velocity: Samples
    """Velocity of m0, shape (samples,) [m/s]."""
    impacts_at_s: tuple[Reals, Reals]
    """Times since the first sample [s], and number of contacts up to each time."""
    base_acceleration: Samples
    """Acceleration of the simulated or recorded table that drove the specimen, shape (samples,) [m/s2]."""
    has_sensors: bool
    """Whether the velocity includes the recorded channel's delay and gain, unlike the true velocity."""

    @property
    def response_delay_s(self) -> float:
        """Lag of the response channel behind the base channel [s]."""
        # A simulated response without a sensor has no delay, but the recorded base may have a delay.
        return super().response_delay_s if self.has_sensors else -self.recording.channel(BASE).delay_s

    def response_gain(self, frequency_hz: Reals) -> Complexes:
        """Ratio of the response sensor's gain to the base sensor's, without their delays."""
        if self.has_sensors:
            return super().response_gain(frequency_hz)
        # The base motion recorded by a sensor drove the simulation. The simulated response has no sensor.
        return np.ones(frequency_hz.size, dtype=np.complex128)

    def read(self, start: int, stop: int) -> Reals:
        """Return the recorded drive, base acceleration and simulated velocity, shape (3, samples)."""
        drive_v = self.recording.read(DRIVE, start, stop)
        return np.stack(
            [drive_v, self.base_acceleration[start:stop], self.velocity[start:stop]], dtype=np.float64
        )

    def played_impacts(self, label: str) -> tuple[float, float]:
        """Return the number of impacts in all segments with this label, and the segments' duration [s]."""
        rate = self.sample_rate_hz
        ends = np.array([(each.start / rate, each.stop / rate) for each in self.stretches(label)])
        if not ends.size:
            return 0.0, 0.0
        counted = np.interp(ends, *self.impacts_at_s)
        return float(np.sum(np.diff(counted))), float(np.sum(np.diff(ends)))


def under_base_motion(
    recording: Recording, measurement: Measurement, specimen: Specimen
) -> SimulatedChannels:
    """Simulate a specimen from rest, driven by a recording's base motion, at the recording's full rate.

    Raises UnusableData when samples were lost, or the simulation did not finish.
    """
    rate, base_m = recording.sample_rate_hz, recorded_base_motion(recording, measurement)
    velocity, impacts = shake_specimen(specimen, base_m, rate)
    return SimulatedChannels(
        recording,
        velocity=velocity,
        impacts_at_s=(np.arange(impacts.size) / rate, impacts.astype(np.float64)),
        base_acceleration=recording.read(BASE),
        has_sensors=False,
    )


def shake_specimen(
    specimen: Specimen, displacement_m: Reals, sample_rate_hz: float
) -> tuple[Reals, Integers]:
    """Return m0's velocity and the number of impacts at every sample of the base displacement."""
    count = displacement_m.size
    velocity = np.zeros(count)
    impacts = np.zeros(count, dtype=np.int64)
    state = np.zeros(_STATE)
    piece = round(_PIECE_S * sample_rate_hz)
    for first in range(0, count - 1, piece):
        last = min(first + piece, count - 1)
        before, behind = min(_OVERLAP, first), min(_OVERLAP, count - 1 - last)
        part = Sampled(displacement_m[first - before : last + 1 + behind], sample_rate_hz)
        ends = {"first": before, "last": before + last - first}
        path = follow_samples(specimen, part, Accuracy.STANDARD, state, **ends)
        if not path.reached_end:
            raise UnusableData(
                f"the simulation from the recorded base motion failed after "
                f"{(first + len(path.states)) / sample_rate_hz:.3g} s: the base moves too much"
            )
        velocity[first : last + 1] = path.states[:, _VX]
        impacts[first + 1 : last + 1] = path.impacts
        state = path.states[-1]
    return velocity, np.cumsum(impacts)
