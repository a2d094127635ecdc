"""Predicted responses to sines, and overlays of simulations: draws analysed by the same estimator."""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import ClassVar, Generic, TypeVar

import numpy as np

from vibench.acquisition.plan import Approach, Measurement, base_motion
from vibench.acquisition.rig import Rig
from vibench.sim import (
    Accuracy,
    Harmonic,
    Outcome,
    Response,
    Specimen,
    base_transmissibility,
    steady_response,
)

from ..frequency_response.noise_response import NoiseAnalysis, NoiseResponse
from ..frequency_response.results import FrequencyResponse
from ..signals import Envelope, Flags, Integers, Reals, runs_of
from ..sine import dwell_analysis
from ..sine.dwell import DwellResponse
from ..sine.stepped_response import SteppedResponse, SteppedSineAnalysis
from ..sine.sweep import SweptMotion
from ..sine.sweep_analysis import Collisions, SweepAnalysis, collisions
from ..tables import Tabular, columns
from .draws import DrawSet, SimulatedRun
from .ensemble import (
    MIXED,
    CurveDifference,
    Ending,
    EnsembleCurve,
    EscapeRate,
    Phase,
    Quantity,
    escape_rate,
    logarithmic_difference,
)

PAPER_AMPLITUDES_M = {0.05: 1e-6, 1.5: 5e-6, 10.0: 50e-6}
"""Base amplitude A0 that the paper simulates for each of its voltages V0 (Gong et al. 2025, Fig. 13)."""
PAPER_RESONANCES_HZ = (95.0, 266.0, 500.0)
"""Resonances of m0 without contact [Hz] (Gong et al. 2025, section 5)."""
PAPER_TERMINAL_RESONANCES_HZ = (201.0, 435.0)
"""Resonances of m0 with m1 bound to m2 [Hz] (Gong et al. 2025, section 5)."""
PREDICTION_S = 8.0
WINDOW_S = 5.0
"""Total and observed time [s]: 3 s settling (slowest transient falls to 3e-5), 5 s as in the paper."""


@dataclass(frozen=True, eq=False)
class ResponsePrediction(Tabular):
    """Responses of m0 to sines; arrays of shape (points,)."""

    specimen: Specimen
    frequency_hz: Reals
    amplitude_m: Reals
    """Base amplitude A0 at each frequency."""
    response_i: Reals
    """Response I; like Response II, NaN if the simulation did not finish."""
    response_ii: Reals
    linear: Reals
    """|x / U| of the linear model, without contact."""
    impacts: Integers
    """Number of impacts within the observed time."""
    accuracy: Accuracy
    duration_s: float
    window_s: float

    @property
    def is_colliding(self) -> Flags:
        """Flags of points with collisions within the observed time."""
        return np.asarray(self.impacts > 0)


def predict(
    specimen: Specimen,
    frequency_hz: Reals,
    amplitude_m: Reals | float,
    accuracy: Accuracy = Accuracy.QUICK,
    *,
    duration_s: float = PREDICTION_S,
    approach: Approach = Approach.REST,
) -> ResponsePrediction:
    """Simulate a sine at each frequency: in parallel from rest, or in sequence like a sweep.

    Parameters
    ----------
    frequency_hz
        Frequencies of the sines [Hz], ascending, shape (points,).
    amplitude_m
        Base amplitude A0, one value for all points or one per point [m].
    accuracy
        Quick by default: free flight is exact at every level of accuracy and, in chaos, the scatter of
        Response I exceeds the error of every level.
    """
    amplitudes = np.broadcast_to(np.asarray(amplitude_m, dtype=np.float64), frequency_hz.shape)
    drives = [Harmonic(float(f), float(a)) for f, a in zip(frequency_hz, amplitudes, strict=True)]
    # If a point starts from the previous point, half of the time is for settling after the frequency step.
    window_s = min(WINDOW_S, duration_s if approach is Approach.REST else duration_s / 2)

    def point(drive: Harmonic, state: Reals | None = None, for_s: float = duration_s) -> Response:
        return steady_response(specimen, drive, accuracy, for_s, window_s, state)

    match approach:
        case Approach.REST:
            with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
                points = list(pool.map(point, drives))
        case Approach.UP:
            points = list(_follow_points(point, drives, duration_s))
        case Approach.DOWN:
            points = list(_follow_points(point, drives[::-1], duration_s))[::-1]
    ended = np.array([each.outcome is Outcome.REACHED_END for each in points])
    return ResponsePrediction(
        specimen=specimen,
        frequency_hz=np.asarray(frequency_hz, dtype=np.float64),
        amplitude_m=amplitudes.copy(),
        response_i=np.where(ended, [each.response_i for each in points], np.nan),
        response_ii=np.where(ended, [each.response_ii for each in points], np.nan),
        linear=np.abs(base_transmissibility(specimen, frequency_hz)[:, 0]),
        impacts=np.array([each.impacts for each in points], dtype=np.int64),
        accuracy=accuracy,
        duration_s=duration_s,
        window_s=window_s,
    )


def _follow_points(
    point: Callable[[Harmonic, Reals | None, float], Response],
    drives: Sequence[Harmonic],
    duration_s: float,
) -> Iterator[Response]:
    """Simulate each point from the final state of the previous one, with continuous drive phase.

    The first point starts from rest and has time to settle.
    """
    state, turns = None, 0.0
    for drive in drives:
        for_s = duration_s if state is not None else max(duration_s, PREDICTION_S)
        found = point(replace(drive, phase_rad=2 * np.pi * turns), state, for_s)
        yield found
        turns = (turns + drive.frequency_hz * for_s) % 1.0
        state = found.final_state if found.outcome is Outcome.REACHED_END else None


def paper_amplitude_m(amplitude_vpp: float) -> float | None:
    """Return the A0 of the paper for one of its three voltages; None for other voltages."""
    for voltage, amplitude in PAPER_AMPLITUDES_M.items():
        if np.isclose(voltage, amplitude_vpp, rtol=1e-3):
            return amplitude
    return None


PREDICTION_STEP_HZ = 2.0
_FINE_STEP_HZ = 0.25
_HIGHEST_PREDICTED_HZ = 700.0
"""Highest predicted frequency; above the highest mode (500 Hz) curves fall smoothly."""

R = TypeVar("R")
_Sines = TypeVar("_Sines", SweptMotion, DwellResponse, SteppedResponse)


@dataclass(frozen=True, eq=False)
class AbstractOverlay(Tabular, Generic[R]):
    """A measurement with its simulation."""

    DOCUMENT: ClassVar = "*run difference ensemble escape"

    run: SimulatedRun
    response: R
    """Response of the first draw; all draws are equivalent."""
    ensemble: tuple[EnsembleCurve, ...]
    """Every compared quantity, measured and in all draws, with bands if there are at least five draws."""
    escape: EscapeRate | None
    """Rate at which the motion ends, if its end is random."""
    difference: CurveDifference
    """Ratio of the measured transmission or Response II to the median of all draws."""
    prediction: ResponsePrediction
    """Predicted response to sines of the measured base amplitude A0."""

    @property
    def agreement(self) -> tuple[str, ...]:
        """Sentence on the quantities that disagree with the simulation, then a sentence on each quantity."""
        outside = [each.name for each in self.ensemble if not each.agrees]
        compared = sum(each.compared > 0 for each in self.ensemble)
        headline = [f"{len(outside)} of {compared} quantities disagree with the twin: {', '.join(outside)}"]
        ordered = sorted(self.ensemble, key=lambda each: each.agrees)
        return (*(headline if outside else []), *(each.sentence for each in ordered))

    def quantity(self, name: str) -> EnsembleCurve | None:
        """Return the quantity with this name, measured and in all draws; None if it has no draws."""
        return next((each for each in self.ensemble if each.name == name), None)


@dataclass(frozen=True, eq=False)
class NoiseOverlay(AbstractOverlay[NoiseResponse]):
    """A measured transmission with its simulation."""

    DOCUMENT: ClassVar = f"{AbstractOverlay.DOCUMENT} resonances=response.resonances"

    amplitude_basis: str
    """Source of the base amplitude A0 of the predicted sines."""


@dataclass(frozen=True, eq=False)
class SweepOverlay(AbstractOverlay[SweptMotion]):
    """A measured sweep with its simulation."""

    DOCUMENT: ClassVar = f"{AbstractOverlay.DOCUMENT} collision_regions=collisions.regions"

    collisions: Collisions
    """Collision regions of the first draw."""


@dataclass(frozen=True, eq=False)
class DwellOverlay(AbstractOverlay[DwellResponse]):
    """A measured dwell with its simulation."""

    OWN_UNITS: ClassVar = {"displacement": "m"}
    DOCUMENT: ClassVar = (
        f"{AbstractOverlay.DOCUMENT} response_i=response.response_i response_ii=response.response_ii "
        "sd_response_ii=response.sd_response_ii terminal_bands=terminal"
    )

    displacement: Envelope
    terminal: tuple[dwell_analysis.TerminalLevel, ...]
    """Levels of the terminal bands; like `displacement`, from the first draw."""
    spectrum: EnsembleCurve
    """Spectrum of the displacement divided by A0; not compared, because the model has no noise floor."""

    def quantity(self, name: str) -> EnsembleCurve | None:
        """Return the quantity with this name, or the spectrum."""
        return self.spectrum if name == SPECTRUM else super().quantity(name)


@dataclass(frozen=True, eq=False)
class SteppedSineOverlay(AbstractOverlay[SteppedResponse]):
    """A measured stepped sine with its simulation."""

    DOCUMENT: ClassVar = (
        f"{AbstractOverlay.DOCUMENT} response_i=response.response_i response_ii=response.response_ii"
    )


TRANSMISSION, RESPONSE_I, RESPONSE_II, SPECTRUM = "transmission", "Response I", "Response II", "spectrum"
PHASE = "phase of the response over the base"
"""Names of the compared quantities."""


def _difference(drawn: DrawSet[R], name: str, sd: Reals, simulated: tuple[Reals, Reals]) -> CurveDifference:
    """Compare a measured quantity with the median of the draws, or with a single draw and its uncertainty."""
    (found,) = (each for each in drawn.ensemble if each.name == name)
    if drawn.run.draws > 1:
        simulated = found.median, found.relative_sd
    return logarithmic_difference(found.frequency_hz, (found.measured, sd), simulated)


def noise_quantities(found: FrequencyResponse) -> tuple[Quantity, ...]:
    """Return the quantities of a noise measurement that are compared with draws."""
    return (
        Quantity(TRANSMISSION, found.frequency_hz, found.magnitude),
        Phase(PHASE, found.frequency_hz, found.phase_rad),
    )


def noise_overlay(analysis: NoiseAnalysis, drawn: DrawSet[NoiseResponse]) -> NoiseOverlay:
    """Compare a transmission with the draws."""
    noise = analysis.excitation
    measured, simulated = analysis.response.frequency_response, drawn.response.frequency_response
    amplitude_m, basis = equivalent_amplitude(analysis)
    stop_hz = min(noise.band_stop_hz, _HIGHEST_PREDICTED_HZ)
    specimen = drawn.run.specimen
    return NoiseOverlay(
        **columns(drawn, "run response ensemble"),
        escape=None,
        difference=_difference(
            drawn,
            TRANSMISSION,
            measured.relative_sd_magnitude,
            (simulated.magnitude, simulated.relative_sd_magnitude),
        ),
        prediction=predict(specimen, prediction_grid(specimen, noise.band_start_hz, stop_hz), amplitude_m),
        amplitude_basis=basis,
    )


def prediction_grid(specimen: Specimen, low_hz: float, high_hz: float) -> Reals:
    """Return the frequencies of a prediction: every 2 Hz, and closer around narrow resonances."""
    coarse = np.arange(low_hz, high_hz + PREDICTION_STEP_HZ / 2, PREDICTION_STEP_HZ)
    near = np.arange(-PREDICTION_STEP_HZ, PREDICTION_STEP_HZ + _FINE_STEP_HZ / 2, _FINE_STEP_HZ)
    middles = (*specimen.natural_frequencies_hz, *specimen.bound_frequencies_hz)
    grid = np.unique(np.concatenate([coarse, *(middle + near for middle in middles)]))
    return np.asarray(grid[(grid >= low_hz) & (grid <= high_hz)])


def equivalent_amplitude(analysis: NoiseAnalysis) -> tuple[float, str]:
    """Return the sine amplitude A0 equivalent to a noise level, and its source."""
    setting_vpp = analysis.facts.measurement.excitation.amplitude_vpp
    paper = paper_amplitude_m(setting_vpp)
    if paper is not None:
        return paper, f"the paper's A0 for {setting_vpp:g} V"
    rms = analysis.response.base_level.rms_displacement_m
    return float(np.sqrt(2) * rms), "a sine of the same rms base displacement"


def _sine_difference(drawn: DrawSet[_Sines], measured: _Sines) -> CurveDifference:
    sd, sd_simulated = (
        np.atleast_1d(each.sd_response_ii / each.response_ii) for each in (measured, drawn.response)
    )
    return _difference(drawn, RESPONSE_II, sd, (np.atleast_1d(drawn.response.response_ii), sd_simulated))


def sine_quantities(
    response: SweptMotion | DwellResponse | SteppedResponse,
    frequency_hz: Reals,
    state: Integers | None = None,
) -> tuple[Quantity, ...]:
    """Return Response I, Response II and the phase of the response relative to the base."""
    values = (np.atleast_1d(e) for e in (response.response_i, response.response_ii, response.phase_rad))
    kinds = ((Quantity, RESPONSE_I), (Quantity, RESPONSE_II), (Phase, PHASE))
    return tuple(
        kind(name, frequency_hz, each, state) for (kind, name), each in zip(kinds, values, strict=True)
    )


_EDGE_S = 1.0
"""Margin around edges of collision regions in which a sweep is not compared."""


def sweep_quantities(response: SweptMotion, found: Collisions) -> tuple[Quantity, ...]:
    """Return the quantities of a sweep that are compared with draws.

    Points are compared if both sweeps have collisions or neither has, except within 1 s of a region's edge.
    """
    state = found.is_colliding.astype(np.int64)
    reach = max(1, round(_EDGE_S / response.interval_s))
    for edge in np.flatnonzero(np.diff(found.is_colliding)):
        state[max(0, edge + 1 - reach) : edge + 1 + reach] = MIXED
    return sine_quantities(response, response.frequency_hz, state)


def sweep_endings(found: Collisions) -> tuple[Ending, ...]:
    """Return the end of the longest collision region, in seconds since the start of the sweep."""
    if not found.regions:
        return ()
    longest = max(found.regions, key=lambda each: each.stop.time_s - each.start.time_s)
    return (Ending("collisions", longest.start.time_s, longest.stop.time_s, not longest.reaches_stop),)


def sweep_overlay(analysis: SweepAnalysis, drawn: DrawSet[SweptMotion]) -> SweepOverlay:
    """Compare a sweep with the draws."""
    measured = analysis.response
    rising = np.argsort(measured.frequency_hz)
    low, high = sorted((float(measured.frequency_hz[0]), float(measured.frequency_hz[-1])))
    specimen = drawn.run.specimen
    grid = prediction_grid(specimen, low, high)
    amplitude_m = np.interp(grid, measured.frequency_hz[rising], measured.drive_amplitude_m[rising])
    return SweepOverlay(
        **columns(drawn, "run response ensemble"),
        escape=escape_rate(sweep_endings(analysis.collisions), drawn.endings),
        collisions=collisions(drawn.response),
        difference=_sine_difference(drawn, measured),
        prediction=predict(specimen, grid, amplitude_m),
    )


_LEAST_BAND = 1e-3
"""Minimum level of a compared band relative to the drive's line; lower levels are generator noise."""


def dwell_quantities(
    response: DwellResponse, towards_hz: tuple[float, ...], endings: Sequence[Ending]
) -> tuple[Quantity, ...]:
    """Return a dwell's quantities that are compared with draws: responses, phase, bands and spectrum."""
    at = np.array([response.drive.frequency_hz])
    state = np.array([sum(each.ended for each in endings)], dtype=np.int64)
    columns_hz, size = dwell_analysis.spectrum_columns(response)
    bands = (
        Quantity(
            f"band around {each.towards_hz:.0f} Hz, relative to the line of the drive",
            np.array([each.towards_hz]),
            np.array([ratio if (ratio := 10 ** (each.decibel / 20)) > _LEAST_BAND else np.nan]),
            state,
        )
        for each in dwell_analysis.terminal_levels(response, towards_hz)
    )
    return (
        *sine_quantities(response, at, state),
        *bands,
        Quantity(SPECTRUM, columns_hz, size, np.repeat(state, size.size)),
    )


def dwell_overlay(
    analysis: dwell_analysis.DwellAnalysis, drawn: DrawSet[DwellResponse], endings: Sequence[Ending]
) -> DwellOverlay:
    """Compare a dwell with the draws; ``endings`` are the measured ends of the motion."""
    towards_hz = dwell_analysis.bound_frequencies_hz(analysis.facts)
    measured = analysis.response
    *ensemble, spectrum = drawn.ensemble
    return DwellOverlay(
        run=drawn.run,
        response=drawn.response,
        ensemble=tuple(ensemble),
        spectrum=spectrum,
        escape=escape_rate(endings, drawn.endings),
        displacement=dwell_analysis.settled_envelope(drawn.response),
        terminal=dwell_analysis.terminal_levels(drawn.response, towards_hz),
        difference=_sine_difference(drawn, measured),
        prediction=predict(
            drawn.run.specimen,
            np.array([measured.drive.frequency_hz]),
            measured.drive.amplitude_m,
            Accuracy.STANDARD,
        ),
    )


def stepped_overlay(analysis: SteppedSineAnalysis, drawn: DrawSet[SteppedResponse]) -> SteppedSineOverlay:
    """Compare the measured responses of all steps with the draws."""
    measured = analysis.response
    return SteppedSineOverlay(
        **columns(drawn, "run response ensemble"),
        escape=None,
        difference=_sine_difference(drawn, measured),
        prediction=predict(drawn.run.specimen, measured.frequency_hz, measured.drive_amplitude_m),
    )


class Simulation(StrEnum):
    """Simulation to overlay on measurements."""

    LEFT_OUT = "left out"
    UNDER_VOLTAGE = "under the recorded voltage"
    """Several simulated runs of rig and specimen; also valid for chaotic motion."""
    UNDER_BASE = "under the recorded base motion"
    """One simulated run of the specimen alone; for linear and coherent motion."""


MOST_POINTS = 60
"""Maximum number of simulated frequencies; their simulation takes a few seconds."""
SIMULATED_S = 6.0
"""Simulated time from rest at each frequency; the transient decays to 0.1 % in half of this time."""
FOLLOWED_POINTS = 200
FOLLOWED_S = 2.0
"""Number of frequency steps that imitate a sweep (small steps cause small transients); time per step [s]."""


@dataclass(frozen=True, eq=False)
class MeasurementPrediction(Tabular):
    """Responses to sines with the base amplitude of the plan or of the rig's model."""

    measurement: Measurement
    prediction: ResponsePrediction
    basis: str
    """Source of the base amplitude, in words."""
    approach: Approach
    """Initial state of each simulated point: rest, or the final state of the previous point."""
    specimen_name: str
    """Name of the specimen in the rig's configuration."""

    @property
    def collision_bands_hz(self) -> tuple[tuple[float, float], ...]:
        """Return the frequency bands with predicted collisions."""
        return bands_of(self.prediction.frequency_hz, self.prediction.is_colliding)

    @property
    def base_text(self) -> str:
        """Return the base amplitude or its range as text."""
        bounds = (np.min(self.prediction.amplitude_m), np.max(self.prediction.amplitude_m))
        return " to ".join(dict.fromkeys(f"{1e6 * each:.3g} µm" for each in bounds))

    @property
    def model(self) -> str:
        """Return the name of the model for a legend."""
        gaps = " and ".join(f"{1e6 * each:g}" for each in dict.fromkeys(self.prediction.specimen.gaps_m))
        return f"{self.specimen_name}, gap {gaps} µm"


def predict_measurement(measurement: Measurement, rig: Rig) -> MeasurementPrediction:
    """Simulate the specimen of a rig over the excited band of a measurement."""
    specimen = rig.specimen.specimen()
    low_hz, high_hz = measurement.excitation.band_hz
    approach = measurement.excitation.approach
    match approach:
        case Approach.REST:
            grid, each_s = prediction_grid(specimen, low_hz, high_hz), SIMULATED_S
            grid = grid[:: -(-len(grid) // MOST_POINTS)]
        case Approach.UP | Approach.DOWN:
            grid, each_s = np.linspace(low_hz, high_hz, FOLLOWED_POINTS, dtype=np.float64), FOLLOWED_S
    base = base_motion(measurement.excitation, rig, grid)
    prediction = predict(specimen, grid, base.amplitude_m, duration_s=each_s, approach=approach)
    return MeasurementPrediction(measurement, prediction, base.basis, approach, rig.specimen.name)


def bands_of(frequency_hz: Reals, is_inside: Flags) -> tuple[tuple[float, float], ...]:
    """Return the bands of points flagged in ``is_inside``; bands end halfway to the next unflagged point."""
    middles = 0.5 * (frequency_hz[1:] + frequency_hz[:-1])
    lows = np.concatenate([frequency_hz[:1], middles])
    highs = np.concatenate([middles, frequency_hz[-1:]])
    return tuple((float(lows[first]), float(highs[stop - 1])) for first, stop in runs_of(is_inside))
