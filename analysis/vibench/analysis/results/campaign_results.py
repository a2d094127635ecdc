"""Analyse one recording or all recordings of a campaign; report those that fail, and continue."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from pydantic import Field, PositiveFloat, ValidationError, model_validator

from vibench.acquisition import RecordingError, open_recording
from vibench.acquisition.recording import Recording, UntilNote, copy_sentence, first_copies
from vibench.acquisition.rig import Rig
from vibench.sim import FrozenModel, Specimen
from vibench.sim.background import Observer, Progress, ignore_progress, stage

from ..errors import AnalysisError, NotEnoughData, UnusableData
from ..frequency_response.noise_response import DEFAULT_REQUEST, NoiseAnalysis
from ..frequency_response.results import Estimator, FrequencyResponseRequest
from ..kinds import (
    ANALYSES,
    FAMILIES,
    NOISE_FAMILY,
    AnyResult,
    DwellResult,
    Json,
    NoiseResult,
    Result,
    SweepResult,
    family_of,
)
from ..overlay.draws import DRAWS, all_draws, base_source, voltage_source
from ..overlay.driven_rig import FittedShaker, described_shaker, fit_shaker
from ..overlay.overlay import AbstractOverlay, Simulation
from ..recordings.channels import RecordedChannels, force_roles, response_role, response_roles, scanned_role
from ..recordings.checks import AbstractAnalysis, Check, Verdict
from ..recordings.facts import RecordingFacts, recording_facts, require_moving_channels, specimen_of
from ..signals import DEFAULT_CONFIDENCE, Window
from ..sine.dwell_analysis import DwellAnalysis
from ..sine.sweep_analysis import SweepAnalysis
from ..tables import plain
from ..uncertainty.budget import Budget
from ..uncertainty.expected import expected_recorded_s


class AnalysisOptions(FrozenModel):
    """Options of an analysis; the options from estimator to confidence apply to noise only."""

    model: Simulation = Simulation.LEFT_OUT
    """Simulation to overlay: rig and specimen driven by the recorded voltage (the twin), or the specimen
    alone driven by the recorded base motion. A simulation takes seconds to minutes per recording."""
    estimator: Estimator = Estimator.DRIVE
    """Estimator: noise on the base biases 'h1', noise on the response biases 'h2', neither biases 'drive'."""
    noise_ratio: float | None = Field(default=None, ge=0.0)
    """For hv only: ratio of the noise densities of m0's velocity and the base acceleration, in s²."""
    window: Window = Window.HANN
    """Window of the segments of streamed noise."""
    resolution_hz: PositiveFloat | None = None
    """Resolution for streamed noise; automatic by default. Give either resolution or averages."""
    averages: Annotated[float, Field(gt=1.0)] | None = None
    """Number of independent averages of streamed noise; automatic by default."""
    overlap: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.5
    """Overlap of neighbouring segments, as a fraction of their length."""
    confidence: Annotated[float, Field(gt=0.0, lt=1.0)] = DEFAULT_CONFIDENCE
    """Probability that the bounds at a spectral line contain the true value."""

    @model_validator(mode="after")
    def _is_allowed(self) -> Self:
        """Refuse invalid combinations of options: building the noise request raises an error for them."""
        self.request  # noqa: B018 - making it is the check
        return self

    @property
    def request(self) -> FrequencyResponseRequest:
        """Noise analysis requested by these options."""
        return FrequencyResponseRequest(**self.model_dump(exclude={"model"}))


CONTRADICTIONS = (ArithmeticError, LookupError, MemoryError, TypeError, ValueError)
"""Errors that calculations raise if the parts of a well-formed recording contradict each other."""


def analyse(
    recording: Recording | Path | str,
    request: FrequencyResponseRequest = DEFAULT_REQUEST,
    observer: Observer = ignore_progress,
    response: str | None = None,
) -> AbstractAnalysis[Any, Any]:
    """Analyse a complete or incomplete recording by the kind of excitation in its plan.

    Raises AnalysisError, with one sentence that names the file, when nothing in it can be analysed.

    Parameters
    ----------
    recording
        An open recording, or its path. An interrupted or growing recording is analysed up to the samples that
        it contains when it is opened.
    request
        Estimator and resolution for noise; other excitations ignore it.
    observer
        Receives the progress.
    response
        Channel to analyse, such as ``"m2_velocity"``; by default the channel that measures m0, or in a scan
        the mass that the vibrometer measured.
    """
    if isinstance(recording, Path | str):
        with open_recording(Path(recording)) as opened:
            return analyse(opened, request, observer, response)
    name, response = recording.path.name, response or scanned_role(recording)
    facts = recording_facts(recording, stage(observer, f"{name}: looking at every channel"), response)
    try:
        channels = RecordedChannels(recording, stage(observer, f"{name}: analysing"), response)
        require_moving_channels(facts.channels, facts.response)
        plan = facts.measurement.excitation
        if channels.is_force and ANALYSES[plan.kind].family != NOISE_FAMILY:
            raise UnusableData(
                f"{facts.response} has results only for noise (the apparent mass); analyse a motion, "
                "or measure noise"
            )
        found: AbstractAnalysis[Any, Any] = ANALYSES[plan.kind].analyse(facts, channels, plan, request)
        found = replace(found, checks=(*found.checks, *_until_checks(facts)))
    except AnalysisError as error:
        ended = f"{facts.state.value}" + (f": {facts.reason}" if facts.reason else "")
        raise type(error)(f"{recording.path.name} ({ended}): {error}") from error
    except CONTRADICTIONS as error:
        raise UnusableData(
            f"{recording.path.name} cannot be analysed: its samples and tables contradict its plan "
            f"({type(error).__name__}: {error}); read the samples with h5py"
        ) from error
    return found


def _until_checks(facts: RecordingFacts) -> Iterator[Check]:
    """Compare the recorded time of a measurement that sets `until` with the predicted time."""
    notes = [each for each in facts.feedback if isinstance(each, UntilNote)]
    if not notes:
        return
    time_s = sum(each.recorded_s or 0.0 for each in notes)
    try:
        expected_s = expected_recorded_s(facts.measurement, Rig.model_validate(facts.bench))
    except ValidationError:  # the recording was imported, or is of another version
        expected_s = None
    forecast = "no time was predicted" if expected_s is None else f"{expected_s:.3g} s were predicted"
    last = f"{notes[-1].sentence}; " if len(notes) == 1 else ""
    reached = sum(each.is_reached for each in notes)
    text = f"{last}{reached} of {len(notes)} parts reached their targets, {time_s:.4g} s in total; {forecast}"
    yield Check("Recorded until known", Verdict.PASSED if reached == len(notes) else Verdict.WARNING, text)


Stage = Callable[[str], None]
"""Callback that receives a short description of the current step."""


def overlay(
    recording: Recording,
    analysis: AbstractAnalysis[Any, Any],
    *,
    specimen: Specimen | None = None,
    simulation: Simulation = Simulation.UNDER_VOLTAGE,
    shaker: FittedShaker | None = None,
    draws: int = DRAWS,
    stage: Stage = lambda _step: None,
) -> AbstractOverlay[Any]:
    """Return the comparison of a measurement with a simulation of the same test.

    Raises UnusableData when samples were lost, or the simulation did not finish.

    Parameters
    ----------
    recording, analysis
        The recording, and its result from `analyse`.
    specimen
        Specimen to simulate; by default the specimen of the recording's bench configuration.
    simulation
        Drive of the simulation: the recorded voltage (rig and specimen) or the recorded base motion (specimen
        alone). An unknown shaker is fitted to weak noise; if the fit fails, the base motion is used.
        ``run.driven`` and ``run.why`` of the result name the choice and its reason.
    shaker
        Result of `fit_shaker` for another recording; used if the bench configuration describes no shaker.
    draws
        Number of simulated runs of a colliding motion, from slightly different initial states.
    stage
        Receives a description of each step.
    """
    model = specimen_of(analysis.facts.bench) if specimen is None else specimen
    driven = "the specimen" if simulation is Simulation.UNDER_BASE else "rig and specimen"
    stage(f"simulating {driven} {simulation.value}")
    source, why = None, ""
    if simulation is Simulation.UNDER_VOLTAGE:
        try:
            if described_shaker(recording) is not None:
                shaker = None
            elif shaker is None and isinstance(analysis, NoiseAnalysis):
                shaker = fit_shaker(recording, analysis, model)
            source = voltage_source(recording, model, shaker, draws)
        except UnusableData as error:
            why = str(error)
    source = source or base_source(recording, analysis.facts.measurement, model, why)
    row = ANALYSES[analysis.excitation.kind]
    found = all_draws(source, row.draws(analysis), row.compared(analysis))
    stage("comparing with the simulation")
    model_overlay: AbstractOverlay[Any] = row.lay(analysis, found)
    return model_overlay


class FailedStep(StrEnum):
    """Step of the analysis that failed."""

    ANALYSIS = "analysis"
    SIMULATION = "simulation"


@dataclass(frozen=True)
class AnalysisFailure:
    """Reason why a recording has no result, or a result has no simulation."""

    DOCUMENT: ClassVar = "recording=name what error=sentence"

    name: str
    what: FailedStep
    sentence: str

    @property
    def with_recording(self) -> str:
        """The reason, preceded by the recording's name if the reason does not contain the name."""
        return self.sentence if self.name in self.sentence else f"{self.name}: {self.sentence}"


@dataclass(frozen=True, eq=False)
class CampaignResults:
    """Results of a campaign; they are the content of a report."""

    name: str
    results: tuple[AnyResult, ...]
    failures: tuple[AnalysisFailure, ...]
    model_sentences: tuple[str, ...] = ()
    """Remarks on the overlaid model, one sentence for each fitted value."""

    @property
    def facts(self) -> tuple[RecordingFacts, ...]:
        """Facts of every recording that has a result."""
        return tuple(each.analysis.facts for each in self.results)

    @property
    def in_order(self) -> tuple[AnyResult, ...]:
        """Results sorted by kind; within one kind, from weak to strong or in the order given."""
        kinds = tuple(ANALYSES)

        def place(each: AnyResult) -> tuple[float, ...]:
            row = ANALYSES[each.kind]
            family = FAMILIES.index(row.family) if row.family in FAMILIES else kinds.index(each.kind)
            return row.family not in FAMILIES, family, *row.place(each.analysis.excitation)

        return tuple(sorted(self.results, key=place))

    @property
    def noise(self) -> tuple[NoiseResult, ...]:
        """Results of noise measurements, weak to strong."""
        return self._results_of(NoiseAnalysis)

    @property
    def sweeps(self) -> tuple[SweepResult, ...]:
        """Results of sweeps, in the order given."""
        return self._results_of(SweepAnalysis)

    @property
    def dwells(self) -> tuple[DwellResult, ...]:
        """Results of dwells, sorted by frequency and then from weak to strong."""
        return self._results_of(DwellAnalysis)

    def _results_of(self, analysis: type[AbstractAnalysis[Any, Any]]) -> tuple[AnyResult, ...]:
        return tuple(each for each in self.in_order if isinstance(each.analysis, analysis))


def analyse_files(
    paths: Sequence[Path],
    name: str,
    simulation: Simulation = Simulation.UNDER_VOLTAGE,
    request: FrequencyResponseRequest = DEFAULT_REQUEST,
    observer: Observer = ignore_progress,
    specimen: Specimen | None = None,
    draws: int = DRAWS,
    response: str | None = None,
) -> CampaignResults:
    """Analyse recordings one after the other with `analyse`, and overlay a simulation on each.

    Copies of a recording are counted once. By default, the simulation uses each recording's bench
    configuration. If this configuration describes no shaker, one is fitted to the weakest noise among the
    recordings. Raises NotEnoughData when no path is given.

    Parameters
    ----------
    paths
        Paths of the recordings.
    name
        Name of the results and the report.
    simulation
        Simulation to overlay on each recording, if any.
    request
        Estimator, resolution and quantities for noise.
    observer
        Receives the progress.
    specimen
        Specimen to simulate; by default the specimen of each bench configuration.
    draws
        Number of simulated runs of each test.
    response
        Channel to analyse; by default as in `analyse`. Only the motion of m0 is simulated.
    """
    if not paths:
        raise NotEnoughData(f"no recording was given for {name!r}; give the paths of one or more .h5 files")
    shaker = _fit_common_shaker(paths, specimen) if simulation is Simulation.UNDER_VOLTAGE else None
    results: list[AnyResult] = []
    failures: list[AnalysisFailure] = []
    for path in paths:
        try:
            with open_recording(path) as recording:
                result, failed = result_of(
                    recording,
                    simulation,
                    request,
                    observer,
                    specimen,
                    shaker=shaker,
                    draws=draws,
                    response=response,
                )
        except (AnalysisError, RecordingError) as error:
            failures.append(AnalysisFailure(path.name, FailedStep.ANALYSIS, str(error)))
            continue
        results.append(result)
        failures.extend(failed)
    return CampaignResults(name, without_copies(results), tuple(failures))


def without_copies(results: Sequence[AnyResult]) -> tuple[AnyResult, ...]:
    """Return the results without copies of a recording; a warning in the kept result names the copies."""
    firsts = first_copies([each.analysis.facts for each in results])
    kept = {first: results[first] for first in firsts}
    for place, (first, each) in enumerate(zip(firsts, results, strict=True)):
        if place != first:
            counted, copy = kept[first].analysis, each.analysis.facts
            sentence = copy_sentence(counted.facts, counted.facts.path.name, copy)
            check = Check("Copies", Verdict.WARNING, f"{copy.path.name} {sentence}; they count once")
            analysis = replace(counted, checks=(*counted.checks, check))
            kept[first] = replace(kept[first], analysis=analysis)
    return tuple(kept.values())


def other_responses(paths: Sequence[Path]) -> dict[str, tuple[Path, ...]]:
    """Return every channel except those of m0, with the recordings that contain this channel.

    A force channel is included only for noise recordings, where it gives the apparent mass. Unreadable
    recordings are left out; their analysis reports the reason.
    """
    found: dict[str, tuple[Path, ...]] = {}
    for path in paths:
        # A recording whose plan has values of wrong types also counts as unreadable.
        with suppress(RecordingError, AttributeError, TypeError), open_recording(path) as recording:
            first = response_role(recording)
            is_noise = family_of(recording.plan) == NOISE_FAMILY
            for role in (*response_roles(recording), *(force_roles(recording) if is_noise else ())):
                if role not in (first, scanned_role(recording)):
                    found[role] = (*found.get(role, ()), path)
    return found


def _fit_common_shaker(paths: Sequence[Path], specimen: Specimen | None) -> FittedShaker | None:
    """Fit a shaker to the weakest suitable noise if any recording needs a shaker; otherwise return None."""
    unknown: list[tuple[float, Path]] = []
    needed = False
    for path in paths:
        try:
            with open_recording(path) as recording:
                if described_shaker(recording) is not None or scanned_role(recording) is not None:
                    continue
                needed = True
                if family_of(recording.plan) == NOISE_FAMILY:
                    unknown.append((float(recording.plan["excitation"]["amplitude_vpp"]), path))
        except (RecordingError, LookupError, TypeError, ValueError, AttributeError):
            continue  # analysing this file will report the reason
    for _, path in sorted(unknown) if needed and len(paths) > 1 else ():
        try:
            with open_recording(path) as recording:
                analysis: NoiseAnalysis = analyse(recording)  # type: ignore[assignment]
                return fit_shaker(recording, analysis, specimen or specimen_of(recording.bench))
        except (AnalysisError, RecordingError):
            continue
    return None


def merge_results(name: str, parts: Sequence[CampaignResults]) -> CampaignResults:
    """Merge the results of separate recordings into one campaign called ``name``."""
    return CampaignResults(
        name,
        tuple(result for part in parts for result in part.results),
        tuple(failure for part in parts for failure in part.failures),
    )


def result_of(
    recording: Recording,
    simulation: Simulation = Simulation.UNDER_VOLTAGE,
    request: FrequencyResponseRequest = DEFAULT_REQUEST,
    observer: Observer = ignore_progress,
    specimen: Specimen | None = None,
    *,
    shaker: FittedShaker | None = None,
    draws: int = DRAWS,
    response: str | None = None,
) -> tuple[AnyResult, tuple[AnalysisFailure, ...]]:
    """Analyse one recording; if only the simulation fails, return the measured result and the failure.

    Raises AnalysisError when nothing in the recording can be analysed.
    """
    name, response = recording.path.name, response or scanned_role(recording)
    analysis = analyse(recording, request, observer, response)
    if simulation is Simulation.LEFT_OUT or response is not None:
        return Result(analysis, None), ()
    try:
        model_overlay = overlay(
            recording,
            analysis,
            specimen=specimen,
            simulation=simulation,
            shaker=shaker,
            draws=draws,
            stage=lambda note: observer(Progress(0, 0, note=f"{name}: {note}")),
        )
    except AnalysisError as error:
        return Result(analysis, None), (AnalysisFailure(name, FailedStep.SIMULATION, str(error)),)
    return Result(analysis, model_overlay), ()


def recordings_in(folder: Path) -> tuple[Path, ...]:
    """Return the recordings in a folder, finished or interrupted, in the order of their start.

    Raises NotEnoughData when the folder contains none.
    """
    found = [*folder.glob("*.h5"), *folder.glob("*.h5.part")]
    if not found:
        below = next((f", such as {path.parent}" for path in sorted(folder.glob("*/*.h5*"))), "")
        raise NotEnoughData(
            f"{folder} contains no recording (.h5, .h5.part); give a folder with recordings{below}"
        )
    return tuple(sorted(found, key=lambda path: (_start_time(path), path.name)))


def _start_time(path: Path) -> str:
    """Return the start time of a recording; unreadable files sort last and are reported later."""
    last = "~"
    try:
        with open_recording(path) as recording:
            return recording.started_utc
    except RecordingError:
        return last


def result_summary(result: AnyResult) -> Json:
    """Return a result as JSON; numbers that are not finite become null."""
    analysis = result.analysis
    return {
        "recording": plain(analysis.facts),
        "checks": plain(analysis.checks),
        "kind": ANALYSES[result.kind].family,
        "measured": plain(analysis),
        "uncertainty": plain(budgets_of(result)),
        "simulated": plain(result.overlay),
    }


def budgets_of(result: AnyResult) -> tuple[Budget, ...]:
    """Return the uncertainty budget of each main number of a result.

    Returns
    -------
    Budgets (JCGM 100:2008). They cover A0 and Responses I and II of a dwell, the largest responses of a sweep
    or stepped sine, and frequency, damping and transmissibility of each resonance in noise. Budgets of a
    recording that lasted until a bound was met are widened: see `Budget.widen`.
    """
    found: tuple[Budget, ...] = ANALYSES[result.kind].budgets(result.analysis, result.overlay)
    has_chosen_end = result.analysis.facts.measurement.until is not None
    return tuple(each.widen() for each in found) if has_chosen_end else found


def budget_sentences(results: CampaignResults) -> Iterator[str]:
    """Yield one sentence for each main number, with its uncertainty and the contributions to it."""
    for each in results.in_order:
        for budget in budgets_of(each):
            yield f"{each.analysis.facts.name}: {budget.sentence}."


def campaign_summary(results: CampaignResults) -> Json:
    """Return all results and failures of a campaign as JSON."""
    return {
        "campaign": results.name,
        "results": [result_summary(each) for each in results.results],
        "failures": plain(results.failures),
    }
