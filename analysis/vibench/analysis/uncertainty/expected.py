"""Expected uncertainty of a plan's results, and recording times that reach the plan's targets."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import sqrt
from typing import ClassVar

import numpy as np
from pydantic import ValidationError

from vibench.acquisition import ConfigurationError
from vibench.acquisition.plan import (
    FEWEST_REALISATIONS,
    LOOK_FACTOR,
    Campaign,
    Dwell,
    Excitation,
    Family,
    HeldDwell,
    HeldNoise,
    Measurement,
    OddMultisine,
    SteppedSine,
    Until,
    WhiteNoise,
    base_motion,
    measuring_s,
    preview_signal,
)
from vibench.acquisition.rig import BaseQuantity, Rig, RigModel, Role, amplifier_of, shaker_of, specimen_of
from vibench.sim import base_transmissibility, fault_in_words
from vibench.sim.shaker.loaded_shaker import LoadedShaker, MotionFailed

from ..errors import AnalysisError, InvalidRequest
from ..frequency_response.resonance import resonances
from ..frequency_response.results import Estimator, FrequencyResponse, FrequencyResponseSettings
from ..overlay.overlay import RESPONSE_I, RESPONSE_II
from ..signals import Quantity, Reals, Window
from ..sine.dwell import DwellResponse, dwell_response
from ..tables import Tabular
from .budget import (
    COVERAGE,
    RESULT_PATTERNS,
    WIDENING,
    Cause,
    ChannelSd,
    Contribution,
    of_one_draw,
    stated_uncertainties,
)

STEADY = 1e-4
"""Relative scatter up to which a simulated motion counts as repeating."""
_SETTLED_S = 2.5
_EDGE_PERIODS = 80
"""Drive periods at each end of a window that integration disturbs."""
_FINEST_STEP_HZ = 51_200.0
_SURELY_OTHER = 5.0
"""Difference between runs [standard errors] above which their motions count as different."""


@dataclass(frozen=True)
class SimulatedDwell:
    """Scatter of simulated dwells of the rig that start in several ways."""

    sd_largest: float
    """Relative standard deviation of Response I; 0 if nothing collides."""
    sd_second: float
    """Relative standard deviation of Response II; 0 if nothing collides."""
    has_several_motions: bool
    """Whether only some of the runs have collisions, or the runs differ by more than chance."""


def simulated_dwell(
    measurement: Measurement, rig: Rig, at_hz: float, window_s: float
) -> SimulatedDwell | None:
    """Simulate amplifier, table and specimen with the plan's voltage, and analyse them like a recording.

    Some runs start more gently than the generator's ramp, others more abruptly. If all reach the same motion,
    the measurement should reach it too. None if a simulation fails, or the window is too short.
    """
    per_period = 2 * int(np.ceil(_FINEST_STEP_HZ / at_hz / 2))
    phase = 2 * np.pi * (np.arange(per_period) + 0.5) / per_period
    volts = _terminal_v(measurement, rig, at_hz) * np.sinc(1 / per_period) * np.sin(phase)
    lengths_s = (measurement.ramp_s + _SETTLED_S, window_s + 2 * _EDGE_PERIODS / at_hz)
    settling, window = (np.tile(volts, round(length_s * at_hz)) for length_s in lengths_s)
    rising = min(round(measurement.ramp_s * at_hz) * per_period, settling.size)
    gentle = np.concatenate([np.linspace(0.0, 1.0, rising) * settling[:rising], settling[rising:]])
    specimen, found = specimen_of(rig), []
    gap_m = min((each for each in specimen.gaps_m if np.isfinite(each)), default=0.0)
    begun = ((gentle, 0.0), (settling, 0.5), (settling, -0.5))
    for beginning, off in begun:
        start = (0.0, off * gap_m, 0.0, 0.0, 0.0, 0.0)
        shaken = LoadedShaker(amplifier_of(rig), shaker_of(rig), specimen, 1 / (per_period * at_hz), start)
        try:
            shaken.move(beginning)
            before = shaken.impacts
            motion = shaken.move(window)
            if shaken.impacts == before:
                continue
            channels = (window, motion.base_acceleration, motion.m0_velocity)
            drive, base, response = (each.reshape(-1, 2).mean(axis=1) for each in channels)
            rate_hz = per_period * at_hz / 2
            found.append(dwell_response(drive, base, response, rate_hz, near_hz=at_hz, window_s=window_s))
        except (MotionFailed, AnalysisError):
            return None
    if not found:
        return SimulatedDwell(0.0, 0.0, has_several_motions=False)
    size = np.array([each.response_ii for each in found])
    largest, second = np.sqrt(np.mean(np.square([_scatter(each) for each in found]), axis=0))
    differ = np.ptp(size) > _SURELY_OTHER * np.sqrt(2) * max(second, STEADY) * np.mean(size)
    return SimulatedDwell(
        float(largest), float(second), has_several_motions=bool(len(found) < len(begun) or differ)
    )


def _scatter(found: DwellResponse) -> tuple[float, float]:
    """Return the relative scatter of Responses I and II, determined as for a recording."""
    # If the part of the motion that does not repeat is small, this part counts as noise.
    like_noise = float(np.nan_to_num(found.noise_error_i)) / found.response_i
    chance = of_one_draw(found).relative or 0.0
    return float(np.hypot(like_noise, chance)), found.sd_response_ii / found.response_ii


def _terminal_v(measurement: Measurement, rig: Rig, at_hz: float) -> float:
    """Return the peak voltage at the terminal: as set, or as feedback needs for the base level."""
    excitation = measurement.excitation
    if not isinstance(excitation, HeldDwell):
        return 0.5 * excitation.amplitude_vpp * rig.generator.terminal_factor()
    held_m = base_motion(excitation, rig, np.array([at_hz])).amplitude_m
    return float(RigModel(rig).volts_for((2 * np.pi * at_hz) ** 2 * held_m, at_hz)[0])


_WINDOW_S, _TENTHS = 5.0, 10
_GRID_HZ = 0.25
_HIGHEST_TURN = 4.0
"""Largest value of Gaussian noise relative to its rms, within about ten thousand cycles."""
_TIMES = (0.25, 1.0, 4.0, 16.0)
_HALF_BAND_HZ = 25_600.0
"""Band of the white noise of a virtual accelerometer [Hz]."""


@dataclass(frozen=True)
class ExpectedResult(Tabular):
    """One quantity of a plan with its expected uncertainty."""

    DOCUMENT: ClassVar = (
        "quantity cause planned_s=time_s relative_expanded_over_s=curve coverage_factor not_stated"
    )
    OWN_UNITS: ClassVar = {"scatter": "1", "lasting": "1"}
    coverage_factor: ClassVar = COVERAGE

    quantity: str
    time_s: float
    """Planned recording time, or the length of the analysed window of a sine [s]."""
    scatter: float | None
    """Relative standard uncertainty due to noise or chance after `time_s`; None if not stated."""
    cause: Cause
    lasting: float
    """Relative standard uncertainty that a longer time does not reduce: calibrations, alignment, clock."""
    not_stated: tuple[Cause, ...]

    def after(self, time_s: float) -> float | None:
        """Return the relative expanded uncertainty after a time; None if the scatter is not stated."""
        if self.scatter is None:
            return None
        return COVERAGE * float(np.hypot(self.scatter * np.sqrt(self.time_s / time_s), self.lasting))

    @property
    def curve(self) -> tuple[tuple[float, float | None], ...]:
        """Recording times from 1/4 to 16 times the planned time [s], with the result of `after` for each."""
        return tuple((factor * self.time_s, self.after(factor * self.time_s)) for factor in _TIMES)

    @property
    def sentence(self) -> str:
        """Expected uncertainty in words."""
        missing = ", ".join(self.not_stated)
        return f"{self.quantity}: {self._noise_text}" + (f"; not stated: {missing}" if missing else "")

    @property
    def _noise_text(self) -> str:
        if self.scatter is None:
            return f"not known beforehand, because {self._hindrance}"
        if self.scatter == 0.0:
            return f"± {100 * COVERAGE * self.lasting:.2g} % ({self.cause.value}, at any duration; k = 2)"
        mark = " (analysed window)" if self.quantity in {RESPONSE_I, RESPONSE_II} else " as planned"
        text = ", ".join(
            f"{100 * half:.2g} % after {time_s:.3g} s" + (mark if time_s == self.time_s else "")
            for time_s, half in self.curve
            if half
        )
        return f"± {text} ({self.cause.value}; k = 2)"

    @property
    def _hindrance(self) -> str:
        match self.cause, self.quantity:
            case Cause.NOISE, name if name == RESPONSE_I:
                return "noise in the motion raises the largest value, and only a recording shows by how much"
            case Cause.NOISE, _:
                return "the sensors' noise is not stated"
            case Cause.CHANCE, name if name in {RESPONSE_I, RESPONSE_II}:
                return "this drive allows several motions, and the initial state decides which is measured"
            case _:
                return "this noise may make the masses collide"


def expected_uncertainty(measurement: Measurement, rig: Rig) -> tuple[ExpectedResult, ...]:
    """Return the expected uncertainty of a plan's results; opens no instrument.

    For noise, the results are frequency, damping and transmissibility at each resonance of the linear
    specimen. For a sine, the results are both Responses over at most 5 s. The random error of a Response is
    the scatter of three simulated runs, analysed like recordings; it is not stated if the runs settle on
    different motions. This error falls with the square root of the time. Other kinds of plan, and rigs
    without a channel for the motion of m0 or for the acceleration of the base, have no expected results.

    Parameters
    ----------
    measurement
        The plan.
    rig
        The rig, with its specimen and its stated sensors and noise.
    """
    has_base = any(channel.role is Role.BASE_ACCELERATION for channel in rig.daq.channels)
    if rig.response is None or not has_base:
        return ()
    stated = stated_uncertainties(rig.model_dump(mode="json"), rig.response)
    match measurement.excitation:
        case Dwell(frequency_hz=at_hz) | HeldDwell(frequency_hz=at_hz):
            return tuple(_of_sine(measurement, rig, stated, at_hz))
        case HeldNoise():
            return ()
        case excitation if excitation.family is Family.NOISE:
            return tuple(_of_noise(measurement, rig, stated))
        case _:
            return ()


MOST_STEPS = 6
"""Maximum number of parts whose end is predicted; all other parts are assumed to last as long on average."""


def recorded_s(measurement: Measurement) -> float:
    """Return the planned recording time of all steps [s]."""
    return float(sum(each.record_s for each in measurement.excitation.steps()))


def expected_recorded_s(measurement: Measurement, rig: Rig) -> float | None:
    """Predict the total recorded time of all parts of a measurement with `until` [s].

    A part ends at the first check at which its bounds are met, at the latest at its planned time. None if the
    scatter cannot be predicted, or the plan does not set `until`.
    """
    return _in_all(measurement, rig, end_s)


def time_to_wishes_s(measurement: Measurement, rig: Rig) -> float | None:
    """Predict the total recorded time of all parts until all targets are reached [s].

    None if the time cannot be predicted, or no time is long enough.
    """
    needed_s = _in_all(measurement, rig, lambda need_s, first_s, _: max(need_s, first_s))
    return needed_s if needed_s is not None and np.isfinite(needed_s) else None


def _in_all(
    measurement: Measurement, rig: Rig, time_s: Callable[[float, float, float], float]
) -> float | None:
    known: list[float] = []
    for need_s, first_s, longest_s in _stretches(measurement, rig):
        if need_s is None:
            return None
        known.append(time_s(need_s, first_s, longest_s))
    steps = sum(1 for _ in measurement.excitation.steps())
    count = steps if isinstance(measurement.excitation, SteppedSine) else 1
    return count * float(np.mean(known)) if known else None


def _stretches(measurement: Measurement, rig: Rig) -> Iterator[tuple[float | None, float, float]]:
    """Yield three durations [s] of some parts: needed for all targets, up to the first check, and planned."""
    until, excitation = measurement.until, measurement.excitation
    if until is None:
        return
    steps = list(excitation.steps())
    if not isinstance(excitation, SteppedSine):
        is_repeated = excitation.period_points is not None
        first_s = FEWEST_REALISATIONS * steps[0].record_s if is_repeated else until.shortest_s
        need = needed_s(expected_uncertainty(measurement, rig), until)
        yield need, first_s, recorded_s(measurement)
        return
    for step in steps[:: -(-len(steps) // MOST_STEPS)]:
        dwell = Dwell(
            amplitude_vpp=excitation.amplitude_vpp,
            frequency_hz=float(step.segment.numbers["frequency_hz"]),
            duration_s=step.record_s,
        )
        alone = measurement.model_copy(update={"excitation": dwell})
        yield needed_s(expected_uncertainty(alone, rig), until), until.shortest_s, step.record_s


def needed_s(expected: tuple[ExpectedResult, ...], until: Until) -> float | None:
    """Return the recorded time after which the expected bounds reach the targets [s]; None if unknown."""
    needs = []
    for name, wish in until.required_bounds.items():
        found = [each for each in expected if re.search(RESULT_PATTERNS[name], each.quantity)]
        if not found:
            return None
        for each in found:
            if each.scatter is None:
                return None
            # For a maximum, `scatter` is 0, and `lasting` is the uncertainty, which does not fall with time.
            share = COVERAGE * WIDENING * (each.scatter or each.lasting) / wish
            fixed = float(np.inf) if share > 1.0 else 0.0
            needs.append(each.time_s * share**2 if each.scatter else fixed)
    return max(needs)


def end_s(need_s: float, first_s: float, longest_s: float) -> float:
    """Return the time of the first check at or after ``need_s``, at most ``longest_s`` [s]."""
    looks = np.ceil(np.log(min(max(need_s, first_s), longest_s) / first_s) / np.log(LOOK_FACTOR) - 1e-6)
    return float(min(first_s * LOOK_FACTOR ** max(0.0, looks), longest_s))


def _missing(*parts: tuple[Contribution, ...]) -> tuple[Cause, ...]:
    return tuple(dict.fromkeys(each.cause for part in parts for each in part if each.relative is None))


def _densities(rig: Rig, frequency_hz: Reals) -> tuple[Reals, float] | None:
    """Return one-sided noise densities: m0's velocity [(m/s)^2/Hz], base acceleration [(m/s2)^2/Hz].

    None if not stated. For an accelerometer on m0, sensor noise is divided by omega.
    """
    response = rig.response or Role.M0_VELOCITY
    of_m0, of_base = _density(rig, response), _density(rig, Role.BASE_ACCELERATION)
    if of_m0 is None or of_base is None:
        return None
    return of_m0 * (2 * np.pi * frequency_hz) ** (2 - 2 * Quantity(response.quantity).derivatives), of_base


def _density(rig: Rig, role: Role) -> float | None:
    sensor, virtual = rig.sensor(role), rig.virtual
    if sensor is not None and sensor.noise_per_rthz is not None:
        return sensor.noise_per_rthz.value**2
    if virtual is None:
        return None
    simulated = {
        Role.M0_VELOCITY: virtual.vibrometer_noise_m_per_s_per_rthz**2,
        Role.BASE_ACCELERATION: virtual.accelerometer_noise_m_per_s2**2 / _HALF_BAND_HZ,
    }
    return simulated.get(role, 0.0)


def _of_noise(measurement: Measurement, rig: Rig, stated: ChannelSd) -> Iterator[ExpectedResult]:
    """Yield the expected results of a modal fit to the lines of the linear specimen with sensor noise."""
    excitation, specimen = measurement.excitation, specimen_of(rig)
    time_s = recorded_s(measurement)
    low_hz, high_hz = excitation.band_hz
    rms_v = preview_signal(excitation, rig)[0].rms_v * rig.generator.terminal_factor()
    # Without contact, p would be Gaussian over many cycles; check whether this p would reach a stop.
    grid: Reals = np.arange(low_hz, high_hz, _GRID_HZ, dtype=np.float64)
    p_m = rms_v * np.abs(RigModel(rig).transfer(BaseQuantity.P, grid)) / np.sqrt(high_hz - low_hz)
    rms_m = float(np.sqrt(np.sum(p_m**2) * _GRID_HZ))
    if _HIGHEST_TURN * rms_m > min(specimen.gaps_m):
        yield ExpectedResult("resonances and transmissibility", time_s, None, Cause.CHANCE, 0.0, ())
        return
    modes: list[tuple[float, tuple[float | None, ...]]] = [
        (hz, (None, None, None)) for hz in specimen.natural_frequencies_hz if low_hz <= hz <= high_hz
    ]
    lines = _expected_lines(excitation, rig, rms_v**2 / (high_hz - low_hz), time_s)
    if lines is not None:
        try:
            found = resonances(lines, low_hz=low_hz, high_hz=high_hz)
        except InvalidRequest:  # too few lines in the band for a fit
            return
        modes = [
            (
                each.frequency_hz,
                (
                    each.sd_frequency_hz / each.frequency_hz,
                    each.sd_damping_ratio / each.damping_ratio,
                    each.sd_peak_magnitude / each.peak_magnitude,
                ),
            )
            for each in found
        ]
    clock, lasting = stated.timing(1), float(stated.clock.relative or 0.0)
    scale = float(np.hypot(stated.scale_sd, lasting))
    calibrations = _missing(stated.response, stated.base, clock)
    for hz, (frequency, damping, peak) in modes:
        at = f"{hz:.0f} Hz"
        yield ExpectedResult(
            f"resonance at {at}, frequency", time_s, frequency, Cause.NOISE, lasting, _missing(clock)
        )
        yield ExpectedResult(f"resonance at {at}, damping ratio", time_s, damping, Cause.NOISE, 0.0, ())
        yield ExpectedResult(f"transmissibility at {at}", time_s, peak, Cause.NOISE, scale, calibrations)


def _expected_lines(
    excitation: Excitation, rig: Rig, density_v: float, time_s: float
) -> FrequencyResponse | None:
    """Return the linear transmission at the lines of a noise drive, with the scatter after a recorded time.

    ``density_v`` is the one-sided density of the terminal voltage [V^2/Hz]. None if no sensor noise is
    stated.
    """
    if isinstance(excitation, WhiteNoise | OddMultisine):
        lines_hz = np.asarray(excitation.lines, dtype=np.float64) * excitation.repetition_hz
        apart_hz = (excitation.band_hz[1] - excitation.band_hz[0]) / lines_hz.size
    else:
        apart_hz = _GRID_HZ
        lines_hz = np.arange(*excitation.band_hz, apart_hz, dtype=np.float64)
    noise = _densities(rig, lines_hz)
    if noise is None:
        return None
    value = base_transmissibility(specimen_of(rig), lines_hz)[:, 0]
    base = density_v * np.abs(RigModel(rig).transfer(BaseQuantity.ACCELERATION, lines_hz)) ** 2
    response = base * np.abs(value / (2 * np.pi * lines_hz)) ** 2
    by_response, by_base = noise[0] / response, noise[1] / base
    relative_sd = np.sqrt((by_response + by_base) / (2 * time_s * apart_hz))
    settings = FrequencyResponseSettings(Estimator.DRIVE, 1.0, 1, Window.BOXCAR, overlap=0.0, confidence=0.95)
    return FrequencyResponse(
        frequency_hz=lines_hz,
        value=value,
        coherence=1 / ((1 + by_response) * (1 + by_base)),
        n_eff=max(time_s * apart_hz, 2.0),
        relative_sd_magnitude=relative_sd,
        sd_phase_rad=relative_sd,
        half_width=COVERAGE * relative_sd,
        coherence_significance=0.0,
        resolution_hz=0.0,
        segments_used=1,
        segments_excluded=0,
        settings=settings,
    )


def _of_sine(measurement: Measurement, rig: Rig, stated: ChannelSd, at_hz: float) -> Iterator[ExpectedResult]:
    """Yield the expected Responses of a sine.

    Yield nothing if a tenth of the window is shorter than a period, or the motion cannot be simulated.
    """
    window_s = min(_WINDOW_S, sum(each.record_s for each in measurement.excitation.steps()))
    if at_hz * window_s < _TENTHS:
        return
    specimen = rig.specimen.specimen()
    amplitude_m = float(base_motion(measurement.excitation, rig, np.array([at_hz])).amplitude_m[0])
    chance = simulated_dwell(measurement, rig, at_hz, window_s)
    if chance is None:
        return
    noise = _densities(rig, np.array([at_hz]))
    omega = 2 * np.pi * at_hz
    size_m = float(abs(base_transmissibility(specimen, [at_hz])[0, 0])) * amplitude_m
    by_noise = None
    if noise is not None:
        shares = noise[0][0] / (omega * size_m) ** 2 + noise[1] / (omega**2 * amplitude_m) ** 2
        by_noise = float(np.sqrt(shares / window_s))
    lasting = float(np.hypot(stated.scale_sd, stated.clock.relative or 0.0))
    missing = _missing(stated.response, stated.base, stated.timing(1))
    for name, scatter in ((RESPONSE_I, chance.sd_largest), (RESPONSE_II, chance.sd_second)):
        error, cause, rest = None if chance.has_several_motions else scatter, Cause.CHANCE, lasting
        if error is not None and scatter <= STEADY:
            # Noise of generator and amplifier moves the masses, and the rig does not state this noise.
            error, cause = None if name == RESPONSE_I else by_noise, Cause.NOISE
        elif error is not None and name == RESPONSE_I:
            # The largest value scatters from window to window, however long the recording is.
            error, rest = 0.0, float(np.hypot(scatter, lasting))
        yield ExpectedResult(name, window_s, error, cause, rest, missing)


@dataclass(frozen=True)
class TimeShare:
    """Recording time of one measurement of a campaign."""

    name: str
    planned_s: float
    """Recording time in the campaign [s]."""
    needed_s: float | None
    """Predicted recording time until the targets are reached [s]; None without targets or a prediction."""
    allotted_s: float
    """Longest recording time of the measurement after the available time has been distributed [s]."""

    @property
    def sentence(self) -> str:
        """Recording time in words."""
        needed = "as planned" if self.needed_s is None else f"needs about {self.needed_s:.3g} s"
        return f"{self.name}: at most {self.allotted_s:.4g} s of recording ({needed})"


def fit_to(campaign: Campaign, rig: Rig, available_s: float) -> tuple[Campaign, tuple[TimeShare, ...]]:
    """Return the campaign with recording times that fill ``available_s``, and the time of each measurement.

    A measurement needs the time after which `expected_uncertainty` reaches the targets in `until`. All needed
    times are multiplied by one factor. Sweeps, and measurements without a prediction, keep their times.

    Raises ConfigurationError when no measurement has targets with a prediction, or the time is too short for
    all targets.
    """
    needs = {each.name: time_to_wishes_s(each, rig) for each in campaign.measurements}
    mine = [each for each in campaign.measurements if needs[each.name] is not None]
    if not mine:
        raise ConfigurationError(
            f"in {campaign.name}, no measurement with 'until' has a predictable duration, so the time of "
            "--within cannot be divided. Nothing was played; add 'until' to a measurement, or omit --within"
        )
    places = campaign.places
    variable_s = sum(places * each.repeats * _cost(each) * recorded_s(each) for each in mine)
    needed_s = sum(places * each.repeats * _cost(each) * (needs[each.name] or 0.0) for each in mine)
    fixed_s = campaign.duration_s - variable_s
    if available_s < fixed_s + needed_s:
        left_s = available_s - fixed_s
        most = (
            f"in this time, bounds would be {sqrt(needed_s / left_s):.2g} times as wide as requested"
            if left_s > 0
            else "ramps, settling and measurements without targets alone take longer"
        )
        raise ConfigurationError(
            f"{available_s:g} s are too short for the targets of {campaign.name}, which need about "
            f"{fixed_s + needed_s:.0f} s: {most}. Nothing was played; give more time or wider bounds"
        )
    factor = (available_s - fixed_s) / needed_s
    changed = [
        each if (need := needs[each.name]) is None else _with_duration(each, factor * need)
        for each in campaign.measurements
    ]
    shares = tuple(
        TimeShare(old.name, recorded_s(old), needs[old.name], recorded_s(new))
        for old, new in zip(campaign.measurements, changed, strict=True)
    )
    return campaign.model_copy(update={"measurements": tuple(changed)}), shares


def _cost(measurement: Measurement) -> float:
    """Return rig time / recorded time; each realisation of noise needs ramps and a wait in addition."""
    has_many = measurement.excitation.stretches > 1
    return measuring_s(measurement) / recorded_s(measurement) if has_many else 1.0


def _with_duration(measurement: Measurement, time_s: float) -> Measurement:
    """Return the measurement with another recording time; noise has only whole realisations."""
    excitation: Excitation = measurement.excitation
    share = time_s / recorded_s(measurement)
    longer = {
        name: max(1, int(share * value + 1e-9)) if isinstance(value, int) else share * value
        for name in ("duration_s", "record_s", "realisations")
        if (value := getattr(excitation, name, None)) is not None
    }
    document = measurement.model_dump() | {"excitation": excitation.model_dump() | longer}
    try:
        return Measurement.model_validate(document)
    except ValidationError as error:
        raise ConfigurationError(
            f"{measurement.name} would be recorded for {time_s:.4g} s, which its kind of excitation does not "
            f"allow ({fault_in_words(error.errors()[0])}). Nothing was played; give less time or wider bounds"
        ) from error
