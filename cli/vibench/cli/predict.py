"""`vibench predict`: Responses I and II, and exponents, over frequency."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, Self

import typer
from pydantic import ValidationError
from rich.box import SIMPLE_HEAD
from rich.table import Table

from vibench.analysis import InvalidRequest
from vibench.sim import (
    BUDGET_S,
    Accuracy,
    Observable,
    Outcome,
    Rest,
    ScenePlan,
    ScenePrediction,
    plan_scene,
    solve_scene,
)
from vibench.sim.background import Progress
from vibench.sim.study import Start, Study, plausibility_warnings, study_solver

from .found_motions import forgetting_text, motions_table, share_text
from .frequency_option import frequencies
from .interruption import told_to_stop
from .output import console, errors, paragraph, print_json, print_table, print_warnings
from .paths import AsJson
from .points import Cluster, Failure, Workers, complain_about_points
from .progress_bars import study_bar
from .specimen_option import DampingTime, Gap, LawOption, SpecimenOption, described, given_options

if TYPE_CHECKING:
    from vibench.sim.study import StudyResults

AUTO: Literal["auto"] = "auto"
_SHOWN = 24
"""Rows of a table on the terminal; all of them are in the JSON and in the file."""
_OPTIONS = {
    "models": "--model",
    "amplitudes_m": "--amplitude",
    "gaps_m": "--gap",
    "damping_times_s": "--damping-time",
    "duration_s": "--duration",
    "window_s": "--window",
    "budget_s": "--budget",
}
"""What the user typed, by the name that the study has for it."""
_ALLOWED = {
    "greater_than": "it must be above 0",
    "greater_than_equal": "it must not be negative",
    "finite_number": "it must be a finite number",
}
"""What an option must be, by the name that the validator has for what it is not."""


def predict(
    amplitude: Annotated[float, typer.Option("--amplitude", metavar="M", help="Of the base displacement.")],
    frequency: Annotated[
        str, typer.Option("--frequency", metavar="F|START:STOP:STEP", help="One frequency or a range [Hz].")
    ],
    specimen: SpecimenOption = None,
    model: LawOption = None,
    damping_time: DampingTime = None,
    gap: Gap = None,
    duration: Annotated[
        str, typer.Option("--duration", metavar="S|auto", help="Length of each run, or until it settles.")
    ] = "30",
    window: Annotated[float, typer.Option("--window", metavar="S", help="Observed at its end.")] = 5.0,
    accuracy: Annotated[
        Accuracy, typer.Option("--accuracy", help="See docs/accuracy.md.")
    ] = Accuracy.STANDARD,
    observe: Annotated[
        str, typer.Option("--observe", help="response; with it lyapunov, scatter.")
    ] = Observable.RESPONSE.value,
    start: Annotated[
        Start, typer.Option("--start", help="rest, or continued from the next lower (up) or higher (down).")
    ] = Start.REST,
    budget: Annotated[
        str,
        typer.Option(
            "--budget",
            metavar="S",
            help="Processor time a point for other starts, where the start is forgotten, and to see whether "
            "chaos lasts; 0 looks for neither.",
        ),
    ] = f"{BUDGET_S:g}s",
    workers: Workers = None,
    cluster: Cluster = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE.h5", help="Keep the answers in a file.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with what FILE.h5 lacks.")] = False,
    explain: Annotated[bool, typer.Option("--explain", help="Say what is computed and why.")] = False,
    as_json: AsJson = False,
) -> None:
    """Predict the responses of m0 and of p over frequency."""
    if resume and out is None:
        raise InvalidRequest("--resume was given without --out, and only a file is gone on with; give both")
    asked = _study(
        {
            "specimen": described(specimen),
            **given_options(models=model, gaps_m=gap, damping_times_s=damping_time),
            "amplitudes_m": (amplitude,),
            "frequencies_hz": frequencies(frequency),
            "observe": _observables(observe),
            "starts": (start,),
            "accuracy": accuracy,
            "duration_s": _duration(duration),
            "window_s": window,
            "budget_s": _budget(budget),
        }
    )
    print_warnings(
        plausibility_warnings(asked.amplitudes_m, asked.gaps_m or asked.specimen.specimen().gaps_m)
    )
    began = time.monotonic()
    with told_to_stop() as is_stopped, study_bar(asked.grid.size) as observer:
        if asked.grid.size == 1 and out is None and cluster is None and study_solver(asked) is solve_scene:
            # One point needs neither a queue nor a file.
            try:
                found = _Found.one(asked, solve_scene(asked.scene((0,) * len(asked.axes), Rest())))
            except (ValueError, RuntimeError) as error:
                found = _Found.none(asked, error)
            observer(Progress(1, 1, 0.0, "1 failed" if found.failures else ""))
        else:
            from vibench.sim.study import solve_study

            existing: Literal["resume", "refuse"] = "resume" if resume else "refuse"
            found = _Found.of(solve_study(asked, out, existing, workers, cluster, observer, is_stopped))
    if as_json:
        print_json(_document(found, time.monotonic() - began))
    else:
        _tell(found)
    if explain:
        (errors if as_json else console).print(paragraph(_explanation(found)))
    complain_about_points(asked, found.failures, found.kept)


@dataclass(frozen=True, eq=False)
class _Found:
    """What is known of the points that were asked for."""

    study: Study
    points: Sequence[ScenePrediction]
    failures: Sequence[Failure]
    taken_s: Sequence[float]
    """Processor time of each point; NaN where it includes what a process pays once."""
    kept: int
    """Points with an answer, good or bad."""

    @classmethod
    def one(cls, study: Study, point: ScenePrediction) -> Self:
        """Make it of the only point of a study."""
        is_whole = point.outcome is Outcome.REACHED_END
        return cls(study, [point], [] if is_whole else [(study.coordinates(0), point.ended)], [math.nan], 1)

    @classmethod
    def none(cls, study: Study, error: Exception) -> Self:
        """Make it of the error that the only point of a study ended in; a refusal is a sentence by itself."""
        why = str(error) if isinstance(error, ValueError) else f"{type(error).__name__}: {error}"
        return cls(study, [], [(study.coordinates(0), why)], [math.nan], 1)

    @classmethod
    def of(cls, results: "StudyResults") -> Self:
        """Make it of a study's results."""
        taken_s = results.values("taken").ravel().tolist()
        failures = list(results.failures())
        return cls(results.study, list(results.predictions()), failures, taken_s, results.kept)


def _study(options: dict[str, object]) -> Study:
    try:
        return Study.model_validate(options)
    except ValidationError as error:
        first = error.errors()[0]
        said = _ALLOWED.get(first["type"], first["msg"].removeprefix("Value error, "))
        place = str(first["loc"][0]) if first["loc"] else ""
        given = f"{_OPTIONS.get(place, place)} was given as {first['input']!r}: " if place else ""
        raise InvalidRequest(given + said) from error


def _observables(text: str) -> tuple[Observable, ...]:
    names = [part.strip() for part in text.split(",")]
    known = (Observable.RESPONSE, Observable.LYAPUNOV, Observable.SCATTER)
    unknown = [name for name in names if name not in known]
    if unknown:
        raise InvalidRequest(f"--observe was given as {text!r}; a point has response, lyapunov and scatter")
    return tuple(Observable(name) for name in names)


def _duration(text: str) -> float | str:
    if text == AUTO:
        return AUTO
    try:
        return float(text)
    except ValueError as error:
        raise InvalidRequest(f"a duration of {text!r} was given; give seconds, or auto") from error


def _budget(text: str) -> float:
    try:
        return float(text.removesuffix("s"))
    except ValueError as error:
        raise InvalidRequest(f"a budget of {text!r} was given; give seconds, as in 1s or 0.5") from error


def _document(found: _Found, elapsed_s: float) -> dict[str, object]:
    """Say every point with its options, for other programs; what is not known is null."""
    from vibench.sim.study import software

    return {
        "points": [each.to_dict() for each in found.points],
        "failures": [{**where, "message": why} for where, why in found.failures],
        "is_complete": found.kept == found.study.grid.size,
        "options": found.study.model_dump(mode="json"),
        "software": software(),
        "elapsed_s": elapsed_s,
    }


@dataclass(frozen=True)
class _Planned:
    """A point, how it was to be answered, and what that took."""

    frequency_hz: float
    plan: ScenePlan
    taken_s: float
    """NaN where it includes what a process pays once."""


def _explanation(found: _Found) -> str:
    """Say how the points are answered: one passage for each run of points that are answered alike."""
    from vibench.sim import measure_cost

    study = found.study
    scenes = [study.scene((0, 0, 0, 0, 0, index), Rest()) for index in range(len(study.frequencies_hz))]
    plans = [
        _Planned(scene.drive.frequency_hz, plan_scene(scene), taken_s)
        for scene, taken_s in zip(scenes, found.taken_s, strict=True)
    ]
    passages = []
    for _, run in groupby(zip(plans, scenes, strict=True), lambda each: each[0].plan.alike):
        alike = list(run)
        measure_cost(alike[len(alike) // 2][1])
        passages.append(_passage([planned for planned, _ in alike]))
    forgotten = forgetting_text(found.points)
    return "\n".join([*passages, forgotten] if forgotten else passages)


def _passage(points: Sequence[_Planned]) -> str:
    """Explain points that follow one another and are answered alike, by the one nearest to its stops."""
    worst = max(points, key=lambda each: each.plan.largest_p_m)
    said = f"{' '.join(worst.plan.sentences)} {_cost(points)}"
    method = worst.plan.method.value
    if len(points) == 1:
        return f"{worst.frequency_hz:g} Hz: {method}. {said}"
    return (
        f"{len(points)} points, {points[0].frequency_hz:g} to {points[-1].frequency_hz:g} Hz: {method}. "
        f"At {worst.frequency_hz:g} Hz: {said}"
    )


def _cost(points: Sequence[_Planned]) -> str:
    """Say what points are estimated to take, and what those took that came after others of their kind."""
    known_s = [each.taken_s for each in points if math.isfinite(each.taken_s)]
    expected = points[0].plan.cost
    whole = replace(expected, time_s=sum(each.plan.cost_s for each in points))
    if not known_s:
        return f"{whole}"
    return f"{whole} {len(known_s)} of {len(points)} took {sum(known_s):.2g} s."


def _tell(found: _Found) -> None:
    rows = Table(
        title="Responses I and II of m0 and of p = y - z, over the base amplitude [-]",
        box=SIMPLE_HEAD,
        padding=0,
        show_edge=False,
    )
    has_exponents = Observable.LYAPUNOV in found.study.observe
    headings = ["f [Hz]", "I", "II", "I of p", "II of p", "impacts", "motion", "error", "starts"]
    for heading in headings + ["exponent [1/s]"] * has_exponents:
        rows.add_column(heading, justify="right")
    points = found.points
    step = max(1, -(-len(points) // _SHOWN))
    for each in points[::step]:
        rows.add_row(
            f"{each.frequency_hz:g}",
            *(
                _number(value)
                for value in (each.response_i, each.response_ii, each.relative_i, each.relative_ii)
            ),
            str(each.impacts),
            str(each.motion),
            "" if each.error_estimate is None else f"{each.error_estimate:.1g}",
            share_text(each),
            *([_number(each.lyapunov_per_s)] if has_exponents else []),
        )
    if points:
        print_table(rows)
    if step > 1:
        console.print(f"every {step}th of {len(points)} points; --json or --out gives all")
    motions = motions_table(points)
    if motions is not None:
        print_table(motions)


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.4g}"
