"""All recordings of a campaign, analysed; one that cannot be analysed says why and stops no other."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import assert_never

from vibench.acquisition import RecordingError, open_recording
from vibench.acquisition.recording import Recording
from vibench.sim import Accuracy, Specimen

from ..errors import AnalysisError, NotEnoughData
from ..frequency_response import DEFAULT_REQUEST, FrequencyResponseRequest, NoiseAnalysis
from ..model import (
    DwellOverlay,
    NoiseOverlay,
    SimulatedChannels,
    Simulation,
    SteppedSineOverlay,
    SweepOverlay,
    dwell_overlay,
    noise_overlay,
    simulated_specimen,
    stepped_overlay,
    sweep_overlay,
)
from ..recordings import ProgressObserver, RecordedChannels, RecordingFacts, specimen_of
from ..sine import (
    DwellAnalysis,
    SteppedSineAnalysis,
    SweepAnalysis,
)
from ._measurement_analysis import UNOBSERVED, RecordingAnalysis, analyse

Overlay = NoiseOverlay | SweepOverlay | DwellOverlay | SteppedSineOverlay
Stage = Callable[[str], None]
"""Told, in a few words, what is being computed."""


def ignore_stage(stage: str) -> None:
    """Watch nothing."""


def overlay(
    recording: Recording,
    analysis: RecordingAnalysis,
    *,
    specimen: Specimen | None = None,
    accuracy: Accuracy = Accuracy.STANDARD,
    stage: Stage = ignore_stage,
) -> Overlay:
    """Simulate what was measured and compare.

    Parameters
    ----------
    recording, analysis
        The recording and what `analyse` made of it.
    specimen
        The model; by default what the recording's bench configuration says is on the shaker.
    accuracy
        Of the contacts in the simulation under the recorded base motion.
    stage
        Told what is being computed.

    Raises
    ------
    UnusableData
        When the base motion has holes, or the simulation did not reach its end.

    """
    facts = analysis.facts
    model = specimen_of(facts.bench) if specimen is None else specimen
    stage("simulating the specimen under the recorded base motion")
    simulated = simulated_specimen(recording, facts.measurement, model, accuracy)
    channels = SimulatedChannels(RecordedChannels(recording), simulated)
    stage("predicting the response to sines")
    match analysis:
        case NoiseAnalysis():
            return noise_overlay(analysis, channels)
        case SweepAnalysis():
            return sweep_overlay(analysis, channels)
        case DwellAnalysis():
            return dwell_overlay(analysis, channels)
        case SteppedSineAnalysis():
            return stepped_overlay(analysis, channels)
        case _:
            assert_never(analysis)


@dataclass(frozen=True, eq=False)
class NoiseResult:
    """A noise measurement and its simulation."""

    analysis: NoiseAnalysis
    laid: NoiseOverlay | None


@dataclass(frozen=True, eq=False)
class SweepResult:
    """A sweep and its simulation."""

    analysis: SweepAnalysis
    laid: SweepOverlay | None


@dataclass(frozen=True, eq=False)
class DwellResult:
    """A dwell and its simulation."""

    analysis: DwellAnalysis
    laid: DwellOverlay | None


@dataclass(frozen=True, eq=False)
class SteppedSineResult:
    """A stepped sine and its simulation."""

    analysis: SteppedSineAnalysis
    laid: SteppedSineOverlay | None


Result = NoiseResult | SweepResult | DwellResult | SteppedSineResult


@dataclass(frozen=True)
class AnalysisFailure:
    """A recording without a result, or a result without its simulation, and why."""

    name: str
    what: str
    """``"analysis"`` or ``"simulation"``."""
    sentence: str


@dataclass(frozen=True, eq=False)
class CampaignResults:
    """What a report is made of."""

    name: str
    results: tuple[Result, ...]
    failures: tuple[AnalysisFailure, ...]
    model_said: tuple[str, ...] = ()
    """What is to be known of the model that was laid over: a sentence for each fitted value."""

    @property
    def facts(self) -> tuple[RecordingFacts, ...]:
        """Of every recording that has a result."""
        return tuple(each.analysis.facts for each in self.results)

    @property
    def noise(self) -> tuple[NoiseResult, ...]:
        """Noise measurements, weak to strong."""
        found = [each for each in self.results if isinstance(each, NoiseResult)]
        return tuple(sorted(found, key=lambda each: each.analysis.excitation.amplitude_vpp))

    @property
    def sweeps(self) -> tuple[SweepResult, ...]:
        """Sweeps, in the order given."""
        return tuple(each for each in self.results if isinstance(each, SweepResult))

    @property
    def dwells(self) -> tuple[DwellResult, ...]:
        """Dwells by frequency, weak to strong."""
        found = [each for each in self.results if isinstance(each, DwellResult)]

        def place(each: DwellResult) -> tuple[float, float]:
            plan = each.analysis.excitation
            return plan.frequency_hz, plan.amplitude_vpp

        return tuple(sorted(found, key=place))

    @property
    def stepped(self) -> tuple[SteppedSineResult, ...]:
        """Stepped sines, in the order given."""
        return tuple(each for each in self.results if isinstance(each, SteppedSineResult))


def analyse_files(
    paths: Sequence[Path],
    name: str,
    simulation: Simulation = Simulation.LAID_OVER,
    request: FrequencyResponseRequest = DEFAULT_REQUEST,
    observer: ProgressObserver = UNOBSERVED,
    specimen: Specimen | None = None,
) -> CampaignResults:
    """Analyse recordings one after the other, each with the model laid over it, as `analyse` does.

    The model is the ``specimen`` given; by default what each recording's bench configuration says.

    Raises
    ------
    NotEnoughData
        When no path is given.

    """
    if not paths:
        raise NotEnoughData(f"no recording was given for {name!r}; give the paths of one or more .h5 files")
    results: list[Result] = []
    failures: list[AnalysisFailure] = []
    for path in paths:
        try:
            with open_recording(path) as recording:
                result, failed = result_of(recording, simulation, request, observer, specimen)
        except (AnalysisError, RecordingError) as error:
            failures.append(AnalysisFailure(path.name, "analysis", str(error)))
            continue
        results.append(result)
        failures.extend(failed)
    return CampaignResults(name, tuple(results), tuple(failures))


def merged_results(name: str, parts: Sequence[CampaignResults]) -> CampaignResults:
    """Put results that were made one by one together as one campaign's."""
    return CampaignResults(
        name,
        tuple(result for part in parts for result in part.results),
        tuple(failure for part in parts for failure in part.failures),
    )


def result_of(
    recording: Recording,
    simulation: Simulation = Simulation.LAID_OVER,
    request: FrequencyResponseRequest = DEFAULT_REQUEST,
    observer: ProgressObserver = UNOBSERVED,
    specimen: Specimen | None = None,
) -> tuple[Result, tuple[AnalysisFailure, ...]]:
    """Analyse one recording; a simulation that fails leaves the measured result standing.

    Raises
    ------
    AnalysisError
        When nothing in the recording is usable.

    """
    name = recording.path.name
    analysis = analyse(recording, request, observer)
    if simulation is Simulation.LEFT_OUT:
        return _paired(analysis, None), ()
    try:
        laid = overlay(
            recording, analysis, specimen=specimen, stage=lambda stage: observer.begin(name, stage)
        )
    except AnalysisError as error:
        return _paired(analysis, None), (AnalysisFailure(name, "simulation", str(error)),)
    return _paired(analysis, laid), ()


def _paired(analysis: RecordingAnalysis, laid: Overlay | None) -> Result:
    match analysis, laid:
        case NoiseAnalysis(), (NoiseOverlay() | None):
            return NoiseResult(analysis, laid)
        case SweepAnalysis(), (SweepOverlay() | None):
            return SweepResult(analysis, laid)
        case DwellAnalysis(), (DwellOverlay() | None):
            return DwellResult(analysis, laid)
        case SteppedSineAnalysis(), (SteppedSineOverlay() | None):
            return SteppedSineResult(analysis, laid)
        case _:
            raise AssertionError(f"{type(laid).__name__} belongs to no {type(analysis).__name__}")


def recordings_in(folder: Path) -> tuple[Path, ...]:
    """List the recordings in a folder, finished or interrupted, in the order they were begun.

    Raises
    ------
    NotEnoughData
        When there are none.

    """
    found = [*folder.glob("*.h5"), *folder.glob("*.h5.part")]
    if not found:
        raise NotEnoughData(f"{folder} holds no recording (.h5 or .h5.part); give a folder that does")
    return tuple(sorted(found, key=lambda path: (_started(path), path.name)))


def _started(path: Path) -> str:
    """Start of a recording; one that cannot be opened comes last and is named as a failure later."""
    last = "~"
    try:
        with open_recording(path) as recording:
            return recording.started_utc
    except RecordingError:
        return last
