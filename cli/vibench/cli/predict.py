"""`vibench predict`, `study` and `tradeoff`: responses over frequency, studies, methods compared."""

import math
import time
from collections.abc import Collection, Sequence
from dataclasses import asdict, replace
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer
from rich.box import SIMPLE_HEAD
from rich.table import Table

from vibench.analysis import InvalidRequest
from vibench.analysis.dynamics import SpecimenChoice
from vibench.sim import (
    BUDGET_S,
    Ensemble,
    MotionKind,
    Observable,
    Outcome,
    Rest,
    Scene,
    ScenePlan,
    ScenePrediction,
    StartMemory,
    count_text,
    number_of,
    solve_scene,
)
from vibench.sim.background import Progress
from vibench.sim.study import Start, Study, plausibility_warnings, study_solver

from .options import Fields, RequestOptions, build_request, option, option_name
from .output import console, errors, paragraph, print_json, print_table, print_warnings
from .paths import AllowExternal, AsJson, require_suffix, room_for_folder
from .progress_bars import study_bar, watch_interrupt
from .scene_options import AXES, SPECIMEN, Cluster, Workers, complain_about_points, frequencies, read_specimen

if TYPE_CHECKING:
    from vibench.sim.accuracy_benchmark import CurvePoint
    from vibench.sim.study import StudyResults


AUTO: Literal["auto"] = "auto"
STUDY_OPTIONS = ("window_s", "accuracy", "error", "time_s")
_SHOWN = 24
"""Largest number of result rows printed on the terminal; JSON and file contain all rows."""


def predict(
    amplitude: Annotated[float, option("Amplitude of the base displacement.", "M")],
    frequency: Annotated[str, option("One drive frequency or a range [Hz].", "F|START:STOP:STEP")],
    duration: Annotated[
        str | None, option("Length of each run; auto: until the motion settles.  [default: 30]", "S|auto")
    ] = None,
    observe: Annotated[str, option("response; optional: lyapunov, scatter.")] = Observable.RESPONSE.value,
    start: Annotated[
        Start, option("Start from rest, or from the motion at a lower (up) or higher (down) frequency.")
    ] = Start.REST,
    budget: Annotated[
        str | None,
        option(
            "Processor time per point to simulate other starts where the motion depends on the start, and "
            f"to test whether chaos lasts; 0 disables both.  [default: {BUDGET_S:g}s]",
            "S",
        ),
    ] = None,
    workers: Workers = None,
    cluster: Cluster = None,
    out: Annotated[Path | None, option("Store the results in a file.", "FILE.h5")] = None,
    resume: Annotated[bool, option("Compute the points missing in FILE.h5.")] = False,
    explain: Annotated[bool, option("Explain what is computed and why.")] = False,
    as_json: AsJson = False,
    *,
    choice: Annotated[RequestOptions[SpecimenChoice], Fields(SPECIMEN)],
    options: Annotated[RequestOptions[Study], Fields(STUDY_OPTIONS)],
) -> None:
    """Predict Responses I and II of m0, and of the motion p of m1, over frequency."""
    if resume and out is None:
        raise InvalidRequest("--resume was given without --out, which it needs; give both")
    require_suffix(out or Path(), ".h5")
    given = {
        "budget_s": budget and _seconds("budget", budget),
        "duration_s": duration if duration in (None, AUTO) else _seconds("duration", duration),
    }
    typed = {name: value for name, value in given.items() if value is not None}
    _refuse_beside_target(typed.keys() | options.typed.keys())
    request = options.request(
        specimen=read_specimen(choice.typed.get("specimen")),
        **{axis: (choice.typed[name],) for axis, name in AXES.items() if name in choice.typed},
        amplitudes_m=(amplitude,),
        frequencies_hz=frequencies(frequency),
        observe=_observables(observe),
        starts=(start,),
        **typed,
    )
    print_warnings(
        plausibility_warnings(request.amplitudes_m, request.gaps_m or request.specimen.specimen().gaps_m)
    )
    began = time.monotonic()
    points: Sequence[ScenePrediction] = []
    target_text = ""
    with watch_interrupt() as is_stopped, study_bar(request.grid.size) as observer:
        if (
            request.grid.size == 1
            and out is None
            and cluster is None
            and study_solver(request) is solve_scene
        ):
            # A single point is solved directly, without worker threads and without a file.
            taken_s, kept, where = [math.nan], 1, request.coordinates(0)
            try:
                scene = request.scene((0,) * len(request.axes), Rest())
                points = [solve_scene(scene) if request.target is None else _refine(scene)]
                failures = [(where, each.ended) for each in points if each.outcome != Outcome.REACHED_END]
                target_text = points[0].target.text if points[0].target is not None else ""
            except (ValueError, RuntimeError) as fault:
                prefix = "" if isinstance(fault, ValueError) else f"{type(fault).__name__}: "
                failures = [(where, f"{prefix}{fault}")]
            observer(Progress(1, 1, 0.0, "1 failed" if failures else ""))
        else:
            from vibench.sim.study import ExistingStudy, solve_study

            existing = ExistingStudy.RESUME if resume else ExistingStudy.REFUSE
            found = solve_study(request, out, existing, workers, cluster, observer, is_stopped)
            points, failures, kept = list(found.predictions()), list(found.failures()), found.done
            taken_s = found.values("taken").ravel().tolist()
            target_text = found.target_text(request.error)
    if as_json:
        from vibench.sim.study import software

        document = {
            "points": [each.to_dict() for each in points],
            "failures": [{**where, "message": why} for where, why in failures],
            "is_complete": kept == request.grid.size,
            "options": request.model_dump(mode="json"),
            "software": software(),
            "elapsed_s": time.monotonic() - began,
        }
        print_json(document)
    else:
        _print_result(points, Observable.LYAPUNOV in request.observe)
        # If the duration is fixed, print for how long chaotic points were simulated.
        is_fixed = request.target is None and request.duration_s != AUTO
        if is_fixed and any(each.motion is MotionKind.CHAOTIC for each in points):
            console.print(
                f"Chaotic over {request.duration_s:g} s; --duration auto tests whether the chaos lasts."
            )
        if target_text:
            console.print(target_text)
    if explain:
        console.print(paragraph(_explanation(request, points, taken_s)))
    complain_about_points(request, failures, kept)


def _refuse_beside_target(typed: Collection[str]) -> None:
    """Refuse options whose values follow from a target error or computing time."""
    targets = [name for name in ("error", "time_s") if name in typed]
    others = [name for name in ("accuracy", "duration_s", "budget_s") if name in typed]
    if targets and others:
        raise InvalidRequest(
            f"--{option_name(targets[0])} was given with --{option_name(others[0])}, which it sets itself; "
            "leave out one of the two"
        )


def _refine(scene: Scene) -> ScenePrediction:
    """Solve one scene with a target error or time, and print each more accurate result."""
    from vibench.sim import refine_scene

    for found in refine_scene(scene):
        if found.target is not None and not found.target.is_met:
            errors.print(found.target.text)
    return found


def _observables(text: str) -> tuple[Observable, ...]:
    names = [part.strip() for part in text.split(",")]
    known = (Observable.RESPONSE, Observable.LYAPUNOV, Observable.SCATTER)
    unknown = [name for name in names if name not in known]
    if unknown:
        raise InvalidRequest(f"--observe was given as {text!r}; allowed are response, lyapunov and scatter")
    return tuple(Observable(name) for name in names)


def _seconds(name: str, text: str) -> float:
    try:
        return number_of(text, "ms", "s", "min", "h")
    except ValueError as error:
        other = f", or {AUTO}" if name == "duration" else ""
        allowed = f"give a time in seconds, such as 1s or 0.5{other}"
        raise InvalidRequest(f"--{name} was given as {text!r}; {allowed}") from error


def _explanation(study: Study, points: Sequence[ScenePrediction], taken_s: Sequence[float]) -> str:
    """Describe how points are solved: one paragraph per group of neighbouring points with the same method."""
    from vibench.sim import plan_scene

    scenes = [study.scene((0, 0, 0, 0, 0, index), Rest()) for index in range(len(study.frequencies_hz))]
    plans = [plan_scene(scene) for scene in scenes]
    passages = []
    for _, run in groupby(range(len(plans)), lambda number: plans[number].batch_key):
        alike = list(run)
        each = [(study.frequencies_hz[k], plans[k], taken_s[k]) for k in alike]
        passages.append(_passage(each, has_target=study.target is not None))
    return "\n".join(filter(None, [*passages, _forgetting_text(points)]))


def _passage(points: Sequence[tuple[float, ScenePlan, float]], *, has_target: bool) -> str:
    """Return a paragraph about neighbouring points with one method; details are for the point of largest p.

    Each entry has frequency [Hz], plan and computing time [s]; the time is NaN if it includes the start of
    the process.
    """
    worst_hz, plan, _ = max(points, key=lambda each: each[1].largest_p_m)
    method, cost = plan.method.value, points[0][1].cost
    text = " ".join(plan.sentences)
    if not has_target:  # a result with a target states the time itself
        text += f" {replace(cost, time_s=sum(each.cost_s for _, each, _ in points))}"
    known_s = [taken_s for *_, taken_s in points if math.isfinite(taken_s)]
    if known_s:
        text += f" {len(known_s)} of {count_text(len(points), 'point')} took {sum(known_s):.2g} s."
    if len(points) == 1:
        return f"{worst_hz:g} Hz: {method}. {text}"
    span = f"{len(points)} points, {points[0][0]:g} to {points[-1][0]:g} Hz"
    return f"{span}: {method}. At {worst_hz:g} Hz: {text}"


def _table(title: str, headings: Sequence[str], caption: str | None = None) -> Table:
    """Return an empty console table without a frame."""
    rows = Table(title=title, caption=caption, box=SIMPLE_HEAD, padding=0, show_edge=False)
    for heading in headings:
        rows.add_column(heading, justify="right")
    return rows


def _print_result(points: Sequence[ScenePrediction], has_exponents: bool) -> None:
    title = "Responses I and II of m0 and p = y - z per base amplitude, and relative error"
    headings = ["f [Hz]", "I", "II", "I of p", "II of p", "impacts", "motion", "error", "starts"]
    rows = _table(title, headings + ["exponent [1/s]"] * has_exponents)
    step = max(1, -(-len(points) // _SHOWN))
    for each in points[::step]:
        numbers = (each.response_i, each.response_ii, each.relative_i, each.relative_ii, each.lyapunov_per_s)
        *responses, exponent = ("" if value is None else f"{value:.4g}" for value in numbers)
        error = "" if each.error_estimate is None else f"{each.error_estimate:.1g}"
        cells = (f"{each.frequency_hz:g}", *responses, str(each.impacts), str(each.motion), error)
        rows.add_row(*cells, _share_text(each), *[exponent] * has_exponents)
    if points:
        print_table(rows)
    if len(points) == 1 and points[0].motion is MotionKind.UNDECIDED:
        console.print(f"Undecided: {points[0].ended}. The responses refer to this window.")
    if step > 1:
        console.print(f"one in {step} points is shown (of {len(points)}); --json or --out gives all points")
    motions = _motions_table(points)
    if motions is not None:
        print_table(motions)


def _share_text(point: ScenePrediction) -> str:
    """Return the fraction of starts that reach this motion (5/8), "lost" for sensitive dependence, or ""."""
    match point:
        case ScenePrediction(ensemble=Ensemble() as ensemble):
            return f"{ensemble.motions[ensemble.requested_motion].starts}/{ensemble.starts}"
        case ScenePrediction(memory=StartMemory.LOST):
            return "lost"
        case _:
            return ""


def _motions_table(points: Sequence[ScenePrediction]) -> Table | None:
    """Return a table of the coexisting motions at points with several motions; None without such points."""
    several = [
        (point, motion)
        for point in points
        if point.ensemble is not None and point.is_one_of_several
        for motion in point.ensemble.motions
    ]
    if not several:
        return None
    title = "Motions with sensitive dependence on the start: starts differ by a millionth of a gap"
    more = f"{len(several) - _SHOWN} more motions: see --json" if len(several) > _SHOWN else None
    rows = _table(title, ("f [Hz]", "I", "II", "I of p", "II of p", "motion", "error", "share"), more)
    for point, motion in several[:_SHOWN]:
        responses = (motion.response_i, motion.response_ii, motion.relative_i, motion.relative_ii)
        rows.add_row(
            f"{point.frequency_hz:g}",
            *("" if value is None else f"{value:.4g}" for value in responses),
            str(motion.motion) if motion.period is None else f"{motion.motion}, {motion.period}",
            "" if motion.error_estimate is None else f"{motion.error_estimate:.1g}",
            f"{motion.share.share:.0%} ({100 * motion.share.low:.0f}-{100 * motion.share.high:.0f}%)",
        )
    return rows


def _forgetting_text(points: Sequence[ScenePrediction]) -> str:
    """Return a text about points that depend sensitively on initial conditions, and about further runs."""
    lost = [point for point in points if point.memory is StartMemory.LOST]
    if not lost:
        return ""
    ensembles = [point.ensemble for point in lost if point.ensemble is not None]
    starts, followed_s = sum(each.starts for each in ensembles), sum(each.followed_s for each in ensembles)
    where = f"At {len(lost)} of {count_text(len(points), 'point')}"
    text = f"{where} the motion depends sensitively on the start, or did not settle."
    if not ensembles:
        averaged = sum(point.target.starts for point in lost if point.target is not None)
        return f"{text} The results there are means over {averaged} starts in total." if averaged else text
    return (
        f"{text} There, {starts} starts were simulated for {followed_s:.0f} s in total; "
        f"several motions at {count_text(sum(each.is_one_of_several for each in lost), 'point')}."
    )


_PAPER_HZ = 260.0
"""Drive frequency [Hz] of the paper's four cases: no contact, two chaotic motions, and a strong drive."""


def tradeoff(
    amplitude: Annotated[float | None, option("Amplitude of your scene's base displacement.", "M")] = None,
    frequency: Annotated[float | None, option("Drive frequency of your scene [Hz].", "F")] = None,
    out: Annotated[Path | None, option("Folder for the figure and its numbers.", "DIR")] = None,
    as_json: AsJson = False,
    *,
    choice: Annotated[RequestOptions[SpecimenChoice], Fields(SPECIMEN)],
    target: Annotated[RequestOptions[Study], Fields(("error", "time_s"))],
) -> None:
    """Compare the error and computing time of each method, for your scene or the paper's cases at 260 Hz.

    Without --error and --time, an error of 1% is requested.
    """
    from vibench.sim.accuracy_benchmark import scene_curve

    from .paper.options import AMPLITUDES_M

    if (amplitude is None) is not (frequency is None):
        raise InvalidRequest("a scene needs both --amplitude and --frequency; one of them is missing")
    studies = [
        build_request(
            Study,
            {
                "specimen": read_specimen(choice.typed.get("specimen")),
                **{axis: (choice.typed[name],) for axis, name in AXES.items() if name in choice.typed},
                "amplitudes_m": (amplitude_m,),
                "frequencies_hz": (_PAPER_HZ if frequency is None else frequency,),
                **(target.typed or {"error": "1 %"}),
            },
        )
        for amplitude_m in (AMPLITUDES_M if amplitude is None else (amplitude,))
    ]
    if out is not None:
        room_for_folder(out)
    curves: dict[str, list[CurvePoint]] = {}
    for study in studies:
        scene = study.scene((0,) * len(study.axes), Rest())
        name = f"{study.models[0]}, {scene.drive.frequency_hz:g} Hz, {1e6 * scene.drive.amplitude_m:g} µm"
        try:
            curves[name] = sorted(scene_curve(scene), key=lambda each: not each.is_chosen)
        except ValueError as fault:
            raise InvalidRequest(str(fault)) from fault
        if not as_json:
            _print_curve(name, curves[name])
            if study.error is not None and not any(each.error <= study.error for each in curves[name]):
                console.print(f"No method reached an error of {100.0 * study.error:g} % in the time limit.")
    if as_json:
        found = [{"scene": name, "points": [asdict(each) for each in own]} for name, own in curves.items()]
        print_json(found[0] if amplitude is not None else {"scenes": found})
    if out is not None:
        from vibench.analysis.report import curve_figure

        path = curve_figure(curves).save(out)[0]
        if not as_json:
            console.print("The figure:", path.resolve())


def _print_curve(name: str, points: "list[CurvePoint]") -> None:
    rows = Table(title=f"error against computing time: {name}", title_justify="left")
    for heading in ("method", "time [s]", "error", "", "Response I", "II"):
        rows.add_column(heading)
    for each in points:
        kind = "stated" if each.is_stated else "against the best"
        numbers = f"{each.time_s:.2g}", f"{each.error:.1g}", kind
        mark = f"{each.method} (chosen)" if each.is_chosen else each.method
        rows.add_row(mark, *numbers, f"{each.response_i:.5g}", f"{each.response_ii:.5g}")
    print_table(rows)


def study(
    plan: Annotated[
        Path, typer.Argument(metavar="STUDY", help="TOML file of the study, or a shipped name: paper.")
    ],
    out: Annotated[Path, option("File for the results.", "FILE.h5")],
    resume: Annotated[bool, option("Compute the points missing in FILE.h5.")] = False,
    workers: Workers = None,
    cluster: Cluster = None,
    only_estimate: Annotated[
        bool, option("Print the number of points and the estimated work; compute nothing.", name="--estimate")
    ] = False,
    _allow_external: AllowExternal = False,
    as_json: AsJson = False,
) -> None:
    """Predict every combination of the values in a file, starting with the longest runs."""
    from vibench.acquisition import file_path, load_toml
    from vibench.sim.study import ExistingStudy, planned_work_s, solve_study

    require_suffix(out, ".h5")
    request = load_toml(file_path(plan, "studies"), Study)
    print_warnings(
        plausibility_warnings(request.amplitudes_m, request.gaps_m or request.specimen.specimen().gaps_m)
    )
    if only_estimate:
        points, work_s = request.grid.size, planned_work_s(request)
        if as_json:
            print_json({"points": points, "work_s": work_s})
        else:
            console.print(f"{points} points, estimated work {work_s:.2g} s on one core")
        return
    existing = ExistingStudy.RESUME if resume else ExistingStudy.REFUSE
    with watch_interrupt() as is_stopped, study_bar(request.grid.size) as observer:
        results = solve_study(request, out, existing, workers, cluster, observer, is_stopped)
    if as_json:
        print_json(study_document(results, out))
    else:
        failed = sum(1 for _ in results.failures())
        state = "complete" if results.is_complete else "stopped: continue with --resume"
        console.print(f"{out}: {results.done} of {results.study.grid.size} points, {failed} failed ({state})")
        if results.study.error is not None:
            console.print(results.target_text(results.study.error))
    complain_about_points(request, list(results.failures()), results.done)


def study_document(results: "StudyResults", out: Path) -> dict[str, object]:
    """Return a summary of a study's results as a JSON study_document; the HDF5 file contains the values."""
    return {
        "file": str(out),
        "points": results.study.grid.size,
        "kept": results.done,
        "is_complete": results.is_complete,
        "sessions": len(results.sessions),
        "failures": [{**where, "message": why} for where, why in results.failures()],
        "study": results.study.model_dump(mode="json"),
    }
