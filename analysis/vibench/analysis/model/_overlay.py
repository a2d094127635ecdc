"""The simulation laid over a measurement: same base motion, same estimator, and how far they differ."""

from dataclasses import dataclass
from enum import Enum, auto
from typing import Generic, TypeVar

import numpy as np

from vibench.acquisition.recording import SegmentLabel
from vibench.sim import Accuracy, Specimen

from ..frequency_response import NoiseAnalysis, NoiseResponse
from ..signals import Envelope, Reals
from ..sine import (
    Collisions,
    DwellAnalysis,
    DwellResponse,
    SteppedResponse,
    SteppedSineAnalysis,
    SweepAnalysis,
    SweepResponse,
    TerminalLevel,
    bound_frequencies_hz,
    collisions,
    measured_dwell,
    measured_sweep,
    settled_envelope,
    terminal_levels,
)
from ._difference import CurveDifference, logarithmic_difference
from ._prediction import ResponsePrediction, paper_amplitude_m, predicted
from ._simulated_channels import SimulatedChannels, SimulatedSpecimen, played_impacts

PREDICTION_STEP_HZ = 2.0
_FINE_STEP_HZ = 0.25
_HIGHEST_PREDICTED_HZ = 700.0
"""Above the highest mode (500 Hz) the curves fall smoothly; predicting there shows nothing."""


@dataclass(frozen=True, eq=False)
class SimulatedRun:
    """The specimen under the recorded base motion, in numbers."""

    specimen: Specimen
    accuracy: Accuracy
    base_low_hz: float
    base_high_hz: float
    """Band of the base displacement that drove it."""
    impacts: int
    """Contacts that began inside the parts that were analysed."""
    played_s: float

    @property
    def impact_rate_hz(self) -> float:
        """Impacts per second."""
        return self.impacts / self.played_s


R = TypeVar("R")


@dataclass(frozen=True, eq=False)
class AbstractOverlay(Generic[R]):
    """A measurement, and what the model says of it."""

    run: SimulatedRun
    response: R
    """Of the simulated specimen under the recorded base motion."""
    difference: CurveDifference
    """Measured over simulated transmission, or Response II."""
    prediction: ResponsePrediction
    """Under sines of the measured A0."""


@dataclass(frozen=True, eq=False)
class NoiseOverlay(AbstractOverlay[NoiseResponse]):
    """A transmission, and what the model says of it."""

    amplitude_basis: str
    """Where the sines' A0 comes from."""


@dataclass(frozen=True, eq=False)
class SweepOverlay(AbstractOverlay[SweepResponse]):
    """A sweep, and what the model says of it."""

    collisions: Collisions


@dataclass(frozen=True, eq=False)
class DwellOverlay(AbstractOverlay[DwellResponse]):
    """A dwell, and what the model says of it."""

    displacement: Envelope
    terminal: tuple[TerminalLevel, ...]
    response_i_db: float
    """Measured over simulated Response I [dB]."""


@dataclass(frozen=True, eq=False)
class SteppedSineOverlay(AbstractOverlay[SteppedResponse]):
    """A stepped sine, and what the model says of it."""


def _run(channels: SimulatedChannels, label: SegmentLabel) -> SimulatedRun:
    simulated: SimulatedSpecimen = channels.simulated
    impacts, played_s = played_impacts(channels, simulated, label)
    return SimulatedRun(
        specimen=simulated.specimen,
        accuracy=simulated.accuracy,
        base_low_hz=simulated.base.low_hz,
        base_high_hz=simulated.base.high_hz,
        impacts=impacts,
        played_s=played_s,
    )


def noise_overlay(
    analysis: NoiseAnalysis, channels: SimulatedChannels, response: NoiseResponse
) -> NoiseOverlay:
    """Compare with ``response``, which was estimated from simulated channels as from the recorded ones."""
    noise = analysis.excitation
    measured, simulated = analysis.response.frequency_response, response.frequency_response
    amplitude_m, basis = equivalent_amplitude(analysis)
    stop_hz = min(noise.band_stop_hz, _HIGHEST_PREDICTED_HZ)
    grid = prediction_grid(channels.simulated.specimen, noise.band_start_hz, stop_hz)
    return NoiseOverlay(
        run=_run(channels, SegmentLabel.NOISE if response.periodic is None else SegmentLabel.REALISATION),
        response=response,
        difference=logarithmic_difference(
            measured.frequency_hz,
            (measured.magnitude, measured.relative_sd_magnitude),
            (simulated.magnitude, simulated.relative_sd_magnitude),
        ),
        prediction=predicted(channels.simulated.specimen, grid, amplitude_m),
        amplitude_basis=basis,
    )


def prediction_grid(specimen: Specimen, low_hz: float, high_hz: float) -> Reals:
    """Frequencies to predict at: every 2 Hz, and closer around the resonances, which are narrower."""
    coarse = np.arange(low_hz, high_hz + PREDICTION_STEP_HZ / 2, PREDICTION_STEP_HZ)
    near = np.arange(-PREDICTION_STEP_HZ, PREDICTION_STEP_HZ + _FINE_STEP_HZ / 2, _FINE_STEP_HZ)
    middles = (*specimen.natural_frequencies_hz, *specimen.bound_frequencies_hz)
    grid = np.unique(np.concatenate([coarse, *(middle + near for middle in middles)]))
    return np.asarray(grid[(grid >= low_hz) & (grid <= high_hz)])


def equivalent_amplitude(analysis: NoiseAnalysis) -> tuple[float, str]:
    """Sine amplitude A0 to set beside a noise level, and where it comes from."""
    setting_vpp = analysis.facts.measurement.excitation.amplitude_vpp
    paper = paper_amplitude_m(setting_vpp)
    if paper is not None:
        return paper, f"the paper's A0 for {setting_vpp:g} V"
    rms = analysis.response.base_level.rms_displacement_m
    return float(np.sqrt(2) * rms), "a sine of the same rms base displacement"


def _difference(
    frequency_hz: Reals,
    measured: SweepResponse | DwellResponse | SteppedResponse,
    simulated: SweepResponse | DwellResponse | SteppedResponse,
) -> CurveDifference:
    """Compare Responses II, with their relative standard deviations."""
    first, second = (
        (np.atleast_1d(each.response_ii), np.atleast_1d(each.sd_response_ii / each.response_ii))
        for each in (measured, simulated)
    )
    return logarithmic_difference(frequency_hz, first, second)


def sweep_overlay(analysis: SweepAnalysis, channels: SimulatedChannels) -> SweepOverlay:
    """Follow the sweep through simulated channels as through the recorded ones."""
    response, _ = measured_sweep(channels, analysis.excitation)
    measured = analysis.response
    rising = np.argsort(measured.frequency_hz)
    low, high = sorted((float(measured.frequency_hz[0]), float(measured.frequency_hz[-1])))
    grid = prediction_grid(channels.simulated.specimen, low, high)
    amplitude_m = np.interp(grid, measured.frequency_hz[rising], measured.drive_amplitude_m[rising])
    return SweepOverlay(
        run=_run(channels, SegmentLabel.SWEEP),
        response=response,
        collisions=collisions(response),
        difference=_difference(measured.frequency_hz, measured, response),
        prediction=predicted(channels.simulated.specimen, grid, amplitude_m),
    )


def dwell_overlay(analysis: DwellAnalysis, channels: SimulatedChannels) -> DwellOverlay:
    """Measure the dwell in simulated channels as in the recorded ones."""
    towards_hz = bound_frequencies_hz(analysis.facts)
    response = measured_dwell(channels, analysis.excitation, towards_hz)
    measured = analysis.response
    return DwellOverlay(
        run=_run(channels, SegmentLabel.DWELL),
        response=response,
        displacement=settled_envelope(response),
        terminal=terminal_levels(response, towards_hz),
        response_i_db=float(20 * np.log10(measured.response_i / response.response_i)),
        difference=_difference(np.array([measured.drive.frequency_hz]), measured, response),
        prediction=predicted(
            channels.simulated.specimen,
            np.array([measured.drive.frequency_hz]),
            measured.drive.amplitude_m,
            Accuracy.STANDARD,
        ),
    )


def stepped_overlay(
    analysis: SteppedSineAnalysis, channels: SimulatedChannels, response: SteppedResponse, label: SegmentLabel
) -> SteppedSineOverlay:
    """Compare with ``response``, measured at every step in simulated channels as in the recorded ones."""
    measured = analysis.response
    return SteppedSineOverlay(
        run=_run(channels, label),
        response=response,
        difference=_difference(measured.frequency_hz, measured, response),
        prediction=predicted(channels.simulated.specimen, measured.frequency_hz, measured.drive_amplitude_m),
    )


class Simulation(Enum):
    """Whether measurements are compared with the model."""

    LAID_OVER = auto()
    LEFT_OUT = auto()
