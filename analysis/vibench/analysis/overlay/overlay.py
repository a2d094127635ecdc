"""Overlay a simulation on a measurement: draws analysed by the same estimator, and their agreement."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar, Generic, TypeVar

import numpy as np

from vibench.sim import Accuracy, Specimen

from ..frequency_response.noise_response import NoiseAnalysis, NoiseResponse
from ..frequency_response.results import FrequencyResponse
from ..signals.arrays import Integers, Reals
from ..signals.envelope import Envelope
from ..sine.collision_region import Collisions, collisions
from ..sine.dwell import DwellResponse
from ..sine.dwell_analysis import (
    DwellAnalysis,
    TerminalLevel,
    bound_frequencies_hz,
    settled_envelope,
    spectrum_columns,
    terminal_levels,
)
from ..sine.stepped_response import SteppedResponse, SteppedSineAnalysis
from ..sine.sweep import SweptMotion
from ..sine.sweep_analysis import SweepAnalysis
from ..tables import Tabular
from .draws import DrawSet, SimulatedRun
from .ensemble import (
    MIXED,
    CurveDifference,
    Ending,
    EnsembleCurve,
    EscapeRate,
    Phase,
    Quantity,
    ensemble_curves,
    escape_rate,
    logarithmic_difference,
)
from .prediction import ResponsePrediction, paper_amplitude_m, predict

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
        """Sentence on the quantities that disagree with the simulation, then one on each quantity."""
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
    terminal: tuple[TerminalLevel, ...]
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


def _difference(
    drawn: DrawSet[R], measured: Quantity, sd: Reals, simulated: tuple[Reals, Reals]
) -> CurveDifference:
    """Compare the measurement with the median of the draws, or with a single draw and its sd."""
    (found,) = ensemble_curves([measured], drawn.quantities)
    if drawn.run.draws > 1:
        simulated = found.median, found.relative_sd
    return logarithmic_difference(measured.frequency_hz, (measured.value, sd), simulated)


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
    compared = noise_quantities(measured)
    return NoiseOverlay(
        run=drawn.run,
        response=drawn.response,
        ensemble=ensemble_curves(compared, drawn.quantities),
        escape=None,
        difference=_difference(
            drawn,
            compared[0],
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


def _sine_difference(
    drawn: DrawSet[_Sines], compared: Sequence[Quantity], measured: _Sines
) -> CurveDifference:
    (quantity,) = (each for each in compared if each.name == RESPONSE_II)
    sd, sd_simulated = (
        np.atleast_1d(each.sd_response_ii / each.response_ii) for each in (measured, drawn.response)
    )
    return _difference(drawn, quantity, sd, (np.atleast_1d(drawn.response.response_ii), sd_simulated))


def sine_quantities(
    response: SweptMotion | DwellResponse | SteppedResponse,
    frequency_hz: Reals,
    state: Integers | None = None,
) -> tuple[Quantity, ...]:
    """Return both responses and the phase of the response over the base."""
    values = (np.atleast_1d(e) for e in (response.response_i, response.response_ii, response.phase_rad))
    kinds = ((Quantity, RESPONSE_I), (Quantity, RESPONSE_II), (Phase, PHASE))
    return tuple(
        kind(name, frequency_hz, each, state) for (kind, name), each in zip(kinds, values, strict=True)
    )


_EDGE_S = 1.0
"""Margin around edges of collision regions in which a sweep is not compared."""


def sweep_quantities(response: SweptMotion, found: Collisions) -> tuple[Quantity, ...]:
    """Return the quantities of a sweep that are compared with draws.

    Points are compared where both sweeps collide or neither does, but not within a second of a region's edge.
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
    compared = sweep_quantities(measured, analysis.collisions)
    return SweepOverlay(
        run=drawn.run,
        response=drawn.response,
        ensemble=ensemble_curves(compared, drawn.quantities),
        escape=escape_rate(sweep_endings(analysis.collisions), drawn.endings),
        collisions=collisions(drawn.response),
        difference=_sine_difference(drawn, compared, measured),
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
    columns_hz, size = spectrum_columns(response)
    bands = (
        Quantity(
            f"band around {each.towards_hz:.0f} Hz, relative to the line of the drive",
            np.array([each.towards_hz]),
            np.array([ratio if (ratio := 10 ** (each.decibel / 20)) > _LEAST_BAND else np.nan]),
            state,
        )
        for each in terminal_levels(response, towards_hz)
    )
    return (
        *sine_quantities(response, at, state),
        *bands,
        Quantity(SPECTRUM, columns_hz, size, np.repeat(state, size.size)),
    )


def dwell_overlay(
    analysis: DwellAnalysis, drawn: DrawSet[DwellResponse], endings: Sequence[Ending]
) -> DwellOverlay:
    """Compare a dwell with the draws; ``endings`` are the measured ends of the motion."""
    towards_hz = bound_frequencies_hz(analysis.facts)
    measured = analysis.response
    compared = dwell_quantities(measured, towards_hz, endings)
    *ensemble, spectrum = ensemble_curves(compared, drawn.quantities)
    return DwellOverlay(
        run=drawn.run,
        response=drawn.response,
        ensemble=tuple(ensemble),
        spectrum=spectrum,
        escape=escape_rate(endings, drawn.endings),
        displacement=settled_envelope(drawn.response),
        terminal=terminal_levels(drawn.response, towards_hz),
        difference=_sine_difference(drawn, compared, measured),
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
    compared = sine_quantities(measured, measured.frequency_hz)
    return SteppedSineOverlay(
        run=drawn.run,
        response=drawn.response,
        ensemble=ensemble_curves(compared, drawn.quantities),
        escape=None,
        difference=_sine_difference(drawn, compared, measured),
        prediction=predict(drawn.run.specimen, measured.frequency_hz, measured.drive_amplitude_m),
    )


class Simulation(StrEnum):
    """Input of the simulation of a measurement, or no simulation."""

    UNDER_VOLTAGE = "rig and specimen under the recorded voltage"
    """Rig and specimen driven by the recorded voltage; for an unknown shaker, the same as UNDER_BASE."""
    UNDER_BASE = "the specimen under the recorded base motion"
    """The specimen alone, driven by the recorded base motion: for linear and coherent motion."""
    LEFT_OUT = "nothing"
