"""The rig of a recording, its fitted shaker, and the recorded signal that drives a simulation.

A simulation driven by the recorded base motion has the interface of a recording.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from enum import StrEnum
from functools import partial

import numpy as np
from pydantic import ValidationError
from scipy.optimize import OptimizeResult, least_squares

from vibench.acquisition.plan import Measurement, StreamedNoise
from vibench.acquisition.recording import Recording, coupling_cut_hz
from vibench.acquisition.rig import Rig, amplifier_of, shaker_of
from vibench.sim import Accuracy, Sampled, Specimen, base_transmissibility, follow_samples
from vibench.sim.shaker.loaded_shaker import Amplifier, Shaker
from vibench.sim.shaker.sampled_voltage import DrivenTable

from ..errors import UnusableData
from ..frequency_response.noise_response import NoiseAnalysis, repeated_response, streamed_response
from ..frequency_response.results import FrequencyResponse
from ..recordings.channels import BASE, DRIVE, RecordedChannels, ResponseChannel, coupled_gain, sensor_gain
from ..signals import Complexes, Flags, Integers, Quantity, Reals, Samples, converted_signal
from ..tables import plus_minus

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


AMPLIFIER = "amplifier_voltage"
"""Role of the channel that records the amplifier's output."""


class Driven(StrEnum):
    """Recorded signal that drives the simulated specimen."""

    AMPLIFIER = "recorded amplifier voltage"
    GENERATOR = "recorded generator voltage"
    BASE = "recorded base motion"

    @property
    def by_voltage(self) -> bool:
        """Whether a voltage drives the simulation, which then includes the shaker's table."""
        return self is not Driven.BASE


@dataclass(frozen=True)
class DrivenRig:
    """Rig and specimen that a recorded voltage drives."""

    table: DrivenTable
    driven: Driven
    role: str
    """Role of the voltage channel."""
    response: str
    """Role of the channel that measures m0."""


def driven_rig(recording: Recording, specimen: Specimen, shaker: Shaker | None = None) -> DrivenRig:
    """Return the rig that the recorded voltage drives.

    Raises UnusableData when the recording does not describe its shaker or amplifier, or does not measure m0.

    Parameters
    ----------
    recording
        Recording; its amplifier voltage is used or, if not recorded, its generator voltage.
    specimen
        Specimen on the table.
    shaker
        Fitted shaker; by default the shaker of the bench configuration.
    """
    response = ResponseChannel(recording).role
    rig = _bench_rig(recording)
    if AMPLIFIER in recording.roles:
        amplifier, driven, role = Amplifier(), Driven.AMPLIFIER, AMPLIFIER
    else:
        amplifier, driven, role = Amplifier() if rig is None else amplifier_of(rig), Driven.GENERATOR, DRIVE
    if shaker is None:
        if rig is None:
            raise UnusableData(
                "the bench in the recording describes no shaker, so the recorded voltage cannot be "
                "simulated; record with a complete bench configuration, or analyse the recording together "
                "with a recording of weak noise on the same rig, from which the shaker can be identified"
            )
        shaker = shaker_of(rig)
    base, m0 = (recording.channel(each) for each in (BASE, response))
    table = DrivenTable(
        amplifier,
        shaker,
        specimen,
        partial(sensor_gain, recording.bench, base),
        partial(sensor_gain, recording.bench, m0),
        coupling_cut_hz(base.coupling),
    )
    return DrivenRig(table, driven, role, response)


def carried_mass(specimen: Specimen, frequency_hz: Reals) -> Complexes:
    """Return the apparent mass without contact: momentum of the masses divided by the base velocity [kg]."""
    moved = base_transmissibility(specimen, frequency_hz)[:, :3]
    return np.asarray(moved @ np.asarray(specimen.masses, dtype=np.float64))


def acceleration_per_volt(shaker: Shaker, s: Complexes, carried_kg: Complexes) -> Complexes:
    """Return the base's acceleration per coil voltage at s = i omega [m/s2/V]."""
    dynamic = (
        shaker.suspension_stiffness_n_per_m
        + shaker.suspension_damping_ns_per_m * s
        + (shaker.moving_mass_kg + carried_kg) * s**2
    )
    coupled = (shaker.coil_resistance_ohm + shaker.coil_inductance_h * s) * dynamic
    return np.asarray(shaker.force_constant_n_per_a * s**2 / (coupled + s * shaker.force_constant_n_per_a**2))


def described_shaker(recording: Recording) -> Shaker | None:
    """Return the shaker of a recording's bench configuration; None if not described."""
    rig = _bench_rig(recording)
    return None if rig is None else shaker_of(rig)


def _bench_rig(recording: Recording) -> Rig | None:
    try:
        return Rig.model_validate(dict(recording.bench))
    except ValidationError:
        return None


def recorded_voltage(recording: Recording, rig: DrivenRig, start: int = 0, stop: int | None = None) -> Reals:
    """Read the driving voltage [V], by default of the whole recording, shape (samples,).

    Raises UnusableData when samples were lost.
    """
    volts = recording.read(rig.role, start, stop)
    lost = int(np.count_nonzero(np.isnan(volts)))
    if lost:
        raise UnusableData(
            f"{lost} samples of the {rig.driven.value.removeprefix('recorded ')} were lost, so the motion "
            "cannot be simulated; the measured result remains valid"
        )
    return volts


LARGEST_CHI2 = 3.0
"""Largest reduced chi square of a valid fit; a larger one means collisions or other moving parts."""
FEWEST_LINES = 30
_TYPICAL = (0.1, 1e4, 20.0, 5.0, 2.0, 1e-4)
"""Starting point of the search: parameters of a small electrodynamic shaker."""
_REACH = np.log(300.0)
"""Largest natural logarithm of the ratio of a parameter to its typical value."""
_PRIOR_SD = 1.0
"""Prior standard deviation of the logarithm of each parameter, for drawing random shakers."""
_STARTS = 12
_NUMBERS = tuple(each.name for each in fields(Shaker))[: len(_TYPICAL)]


@dataclass(frozen=True, eq=False)
class FittedShaker:
    """A shaker with the uncertainty of its parameters."""

    shaker: Shaker
    covariance: Reals
    """Covariance of the logarithms of the first six parameters, shape (6, 6), widened if chi^2 exceeds 1."""
    chi2: float
    """Reduced chi square of the fit."""
    lines: int
    source: str
    """Name of the recording to which the shaker was fitted."""

    @property
    def relative_sd(self) -> dict[str, float]:
        """Relative standard deviation of every parameter."""
        return dict(zip(_NUMBERS, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def sentence(self) -> str:
        """Return a sentence that lists each parameter with plus or minus two standard deviations."""
        values = ", ".join(
            f"{name} = {plus_minus(value := getattr(self.shaker, name), 2 * sd * value)}"
            for name, sd in self.relative_sd.items()
        )
        return (
            f"The shaker was fitted to {self.lines} lines of {self.source} (chi² {self.chi2:.2g} per degree "
            f"of freedom): {values}"
        )

    def random_shaker(self, rng: np.random.Generator) -> Shaker:
        """Return a random shaker within the uncertainty of the parameters."""
        logarithms = rng.multivariate_normal(_logarithms(self.shaker), self.covariance, method="eigh")
        return _shaker(logarithms)


def fit_shaker(
    recording: Recording, analysis: NoiseAnalysis, specimen: Specimen, described: Shaker | None = None
) -> FittedShaker:
    """Fit coil, table and suspension to the transmission from recorded voltage to base, without impacts.

    The base's acceleration per voltage is s^2 G / ((R + L s) D + s G^2) (Beranek, Acoustics, ch. 3),
    where D(s) = k + d s + (m + M(s)) s^2 and M is the specimen's apparent mass. The search starts from
    the ``described`` shaker or, if None, from several typical shakers. Raises UnusableData when there are
    too few lines, or no shaker explains them.
    """
    found = _over_voltage(recording, analysis)
    known = found.is_significant & np.isfinite(found.relative_sd_magnitude) & (found.magnitude > 0)
    lines = int(np.sum(known))
    if lines < FEWEST_LINES:
        raise UnusableData(
            f"{analysis.facts.name} has {lines} lines at which the base follows the voltage; a fit of the "
            f"shaker needs {FEWEST_LINES}"
        )
    frequency_hz = found.frequency_hz[known]
    s: Complexes = np.asarray(2j * np.pi * frequency_hz, dtype=np.complex128)
    measured = found.value[known] / s
    carried = carried_mass(specimen, frequency_hz)
    # Real and imaginary part of ln(measured / modelled) have the same scatter.
    sd = np.maximum(found.relative_sd_magnitude[known], 1e-6)

    def misfit(logarithms: Reals) -> Reals:
        ratio = np.log(acceleration_per_volt(_shaker(logarithms), s, carried) / measured) / sd
        return np.concatenate([ratio.real, ratio.imag])

    best = _best(misfit, described)
    degrees = 2 * lines - len(_TYPICAL)
    chi2 = float(2 * best.cost / degrees)
    if chi2 > LARGEST_CHI2:
        raise UnusableData(
            f"no shaker explains how the voltage moves the base in {analysis.facts.name} (chi² {chi2:.3g} "
            f"per degree of freedom, at most {LARGEST_CHI2:g}): the amplifier, the table or the specimen "
            "differs from its description, or masses collide; check the bench file, or choose weaker noise"
        )
    # The prior keeps an undetermined parameter (such as a small inductance) from affecting the motion.
    precision = best.jac.T @ best.jac / max(chi2, 1.0) + np.eye(len(_TYPICAL)) / _PRIOR_SD**2
    covariance = np.linalg.inv(precision)
    return FittedShaker(_shaker(best.x), covariance, chi2, lines, analysis.facts.name)


def _best(misfit: Callable[[Reals], Reals], described: Shaker | None) -> OptimizeResult:
    """Search from several starting points, because the data mainly determine products of parameters."""
    rng = np.random.default_rng(0)
    typical = np.log(_TYPICAL)
    bounds = (typical - _REACH, typical + _REACH)
    starts = [typical, *(typical + rng.uniform(-1.5, 1.5, (_STARTS, typical.size)))]
    if described is not None:
        starts = [np.clip(_logarithms(described), bounds[0] + 1e-6, bounds[1] - 1e-6)]
    return min(
        (least_squares(misfit, each, bounds=bounds, x_scale="jac") for each in starts),
        key=lambda each: each.cost,
    )


def _logarithms(shaker: Shaker) -> Reals:
    return np.log([getattr(shaker, name) for name in _NUMBERS])


def _shaker(logarithms: Reals) -> Shaker:
    return Shaker(*np.exp(logarithms).tolist())


@dataclass(frozen=True, eq=False)
class _VoltageAndBase(RecordedChannels):
    """Channels for noise estimators, with the voltage in place of the base and the base in place of m0."""

    role: str = field(kw_only=True)

    @property
    def response_delay_s(self) -> float:
        return 0.0

    def response_gain(self, frequency_hz: Reals) -> Complexes:
        return coupled_gain(self.recording.bench, self.recording.channel(BASE), frequency_hz)

    def read(self, start: int, stop: int) -> Reals:
        return np.stack([self.recording.read(each, start, stop) for each in (DRIVE, self.role, BASE)])

    def bridge_flags(self, start: int, stop: int) -> Flags:
        return np.zeros(stop - start, dtype=np.bool_)


def _over_voltage(recording: Recording, analysis: NoiseAnalysis) -> FrequencyResponse:
    """Return s times base acceleration / voltage, analogous to m0's velocity / base acceleration."""
    role = AMPLIFIER if AMPLIFIER in recording.roles else DRIVE
    channels = _VoltageAndBase(recording, role=role)
    plan = analysis.excitation
    if isinstance(plan, StreamedNoise):
        return streamed_response(channels, plan, analysis.request).frequency_response
    return repeated_response(channels, plan, analysis.request)[0]
