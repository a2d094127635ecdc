"""All recordings of a campaign, analysed; one that cannot be analysed says why and stops no other."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

from vibench.acquisition import RecordingError, open_recording
from vibench.acquisition.recording import Recording
from vibench.sim import Accuracy, Specimen

from ..errors import AnalysisError, NotEnoughData
from ..frequency_response import DEFAULT_REQUEST, FrequencyResponseRequest, NoiseAnalysis
from ..kinds import (
    ANALYSES,
    AnyResult,
    DwellResult,
    NoiseResult,
    Result,
    SweepResult,
)
from ..model import AbstractOverlay, SimulatedChannels, Simulation, simulated_specimen
from ..recordings import AbstractAnalysis, ProgressObserver, RecordedChannels, RecordingFacts, specimen_of
from ..sine import DwellAnalysis, SweepAnalysis
from ._measurement_analysis import UNOBSERVED, analyse

Stage = Callable[[str], None]
"""Told, in a few words, what is being computed."""


def ignore_stage(stage: str) -> None:
    """Watch nothing."""


def overlay(
    recording: Recording,
    analysis: AbstractAnalysis[Any, Any],
    *,
    specimen: Specimen | None = None,
    accuracy: Accuracy = Accuracy.STANDARD,
    stage: Stage = ignore_stage,
) -> AbstractOverlay[Any]:
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
    laid: AbstractOverlay[Any] = ANALYSES[analysis.excitation.kind].simulate(analysis, channels)
    return laid


class FailedStep(StrEnum):
    """What a recording has no result of."""

    ANALYSIS = "analysis"
    SIMULATION = "simulation"


@dataclass(frozen=True)
class AnalysisFailure:
    """A recording without a result, or a result without its simulation, and why."""

    name: str
    what: FailedStep
    sentence: str


@dataclass(frozen=True, eq=False)
class CampaignResults:
    """What a report is made of."""

    name: str
    results: tuple[AnyResult, ...]
    failures: tuple[AnalysisFailure, ...]
    model_said: tuple[str, ...] = ()
    """What is to be known of the model that was laid over: a sentence for each fitted value."""

    @property
    def facts(self) -> tuple[RecordingFacts, ...]:
        """Of every recording that has a result."""
        return tuple(each.analysis.facts for each in self.results)

    @property
    def in_order(self) -> tuple[AnyResult, ...]:
        """Family by family, each weak to strong or in the order given."""
        families = tuple(dict.fromkeys(row.family for row in ANALYSES.values()))

        def place(each: AnyResult) -> tuple[float, ...]:
            row = ANALYSES[each.kind]
            return families.index(row.family), *row.place(each.analysis.excitation)

        return tuple(sorted(self.results, key=place))

    @property
    def noise(self) -> tuple[NoiseResult, ...]:
        """Noise measurements, weak to strong."""
        return self._with(NoiseAnalysis)

    @property
    def sweeps(self) -> tuple[SweepResult, ...]:
        """Sweeps, in the order given."""
        return self._with(SweepAnalysis)

    @property
    def dwells(self) -> tuple[DwellResult, ...]:
        """Dwells by frequency, weak to strong."""
        return self._with(DwellAnalysis)

    def _with(self, analysis: type[AbstractAnalysis[Any, Any]]) -> tuple[AnyResult, ...]:
        return tuple(each for each in self.in_order if isinstance(each.analysis, analysis))


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
    results: list[AnyResult] = []
    failures: list[AnalysisFailure] = []
    for path in paths:
        try:
            with open_recording(path) as recording:
                result, failed = result_of(recording, simulation, request, observer, specimen)
        except (AnalysisError, RecordingError) as error:
            failures.append(AnalysisFailure(path.name, FailedStep.ANALYSIS, str(error)))
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
) -> tuple[AnyResult, tuple[AnalysisFailure, ...]]:
    """Analyse one recording; a simulation that fails leaves the measured result standing.

    Raises
    ------
    AnalysisError
        When nothing in the recording is usable.

    """
    name = recording.path.name
    analysis = analyse(recording, request, observer)
    if simulation is Simulation.LEFT_OUT:
        return Result(analysis, None), ()
    try:
        laid = overlay(
            recording, analysis, specimen=specimen, stage=lambda stage: observer.begin(name, stage)
        )
    except AnalysisError as error:
        return Result(analysis, None), (AnalysisFailure(name, FailedStep.SIMULATION, str(error)),)
    return Result(analysis, laid), ()


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
