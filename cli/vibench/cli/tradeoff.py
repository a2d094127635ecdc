"""`vibench tradeoff`: speed against accuracy, measured on this machine."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeElapsedColumn
from rich.table import Table

from vibench.analysis import InvalidRequest
from vibench.analysis.dynamics import SpecimenChoice
from vibench.sim import Accuracy, Rest
from vibench.sim.accuracy_benchmark.curve import scene_curve
from vibench.sim.accuracy_benchmark.figures import (
    LOTTERIES,
    MOTIONS,
    TRANSIENTS,
    AccuracyBenchmark,
    LotteryFigures,
    MotionBenchmark,
)
from vibench.sim.accuracy_benchmark.measuring import Thoroughness, measure_accuracy
from vibench.sim.study import Study

from .options import Fields, RequestOptions, option, validated
from .output import console, errors, print_json, print_table, words
from .paths import AsJson, room_for_folder
from .progress_bars import show_bars
from .specimen_option import AXES, SPECIMEN, read_specimen

_SHORTEST_S = 0.05
_LONGEST_S = 60.0
_STEPS = len(MOTIONS) + len(LOTTERIES) + len(TRANSIENTS)


def tradeoff(
    amplitude: Annotated[float | None, option("Amplitude of your scene's base displacement.", "M")] = None,
    frequency: Annotated[float | None, option("Drive frequency of your scene [Hz].", "F")] = None,
    error: Annotated[str | None, option("Requested error; 1% if neither is given.", "E")] = None,
    time_limit: Annotated[str | None, option("Requested time, such as 2s.", "T", name="--time")] = None,
    out: Annotated[Path | None, option("Folder for the figure and its numbers.", "DIR")] = None,
    span: Annotated[float, option("Length of the motion compared; the paper's test is 2.", "S")] = 2.0,
    as_json: AsJson = False,
    *,
    choice: Annotated[RequestOptions[SpecimenChoice], Fields(SPECIMEN)],
) -> None:
    """Measure error over time: of every method for your scene, or of each accuracy for known motions."""
    said = {"amplitude": amplitude, "frequency": frequency, "error": error, "time": time_limit}
    said = {name: value for name, value in said.items() if value is not None} | dict(choice.typed)
    if said:
        _print_scene(_study(said), out, as_json)
    else:
        _measure_known(out, span, as_json)


def _measure_known(out: Path | None, span: float, as_json: bool) -> None:
    """Measure every accuracy level with motions whose exact solution is known."""
    if not _SHORTEST_S <= span <= _LONGEST_S:
        raise InvalidRequest(f"a span of {span} s was given; give {_SHORTEST_S:g} to {_LONGEST_S:g} s")
    if out is not None:
        room_for_folder(out)
    columns = (words("{task.description:<28}"), BarColumn(bar_width=30), MofNCompleteColumn())
    with show_bars(Progress(*columns, TimeElapsedColumn(), console=errors)) as bars:
        bar = bars.add_task("", total=_STEPS)

        def step(name: str) -> None:
            bars.update(bar, description=name, advance=0 if bars.tasks[0].description == "" else 1)

        benchmark = measure_accuracy(Thoroughness(span_s=span), step)
        bars.update(bar, completed=_STEPS)
    if as_json:
        print_json(_document(benchmark))
    else:
        for each in benchmark.motions:
            _print_levels(each)
        _print_shares(benchmark.lotteries)
    if out is not None:
        from vibench.analysis.report import tradeoff_figure

        tradeoff_figure(benchmark).save(out)


def _study(said: Mapping[str, Any]) -> Study:
    if not {"amplitude", "frequency"} <= said.keys():
        raise InvalidRequest("a scene needs both --amplitude and --frequency; one or both are missing")
    target = {field: said[name] for name, field in (("error", "error"), ("time", "time_s")) if name in said}
    return validated(
        Study,
        {
            "specimen": read_specimen(said.get("specimen")),
            **{axis: (said[name],) for axis, name in AXES.items() if name in said},
            "amplitudes_m": (said["amplitude"],),
            "frequencies_hz": (said["frequency"],),
            **(target or {"error": "1 %"}),
        },
    )


def _print_scene(study: Study, out: Path | None, as_json: bool) -> None:
    from vibench.analysis.report import curve_figure

    if out is not None:
        room_for_folder(out)
    scene = study.scene((0,) * len(study.axes), Rest())
    try:
        points = sorted(scene_curve(scene), key=lambda each: not each.is_chosen)
    except ValueError as fault:
        raise InvalidRequest(str(fault)) from fault
    name = f"{study.models[0]}, {scene.drive.frequency_hz:g} Hz, {1e6 * scene.drive.amplitude_m:g} µm"
    if as_json:
        print_json({"scene": name, "points": [asdict(each) for each in points]})
    else:
        rows = Table(title=f"error over time: {name}", title_justify="left")
        for heading in ("method", "time [s]", "error", "", "Response I", "II"):
            rows.add_column(heading)
        for each in points:
            kind = "stated" if each.is_stated else "from the best"
            numbers = f"{each.time_s:.2g}", f"{each.error:.1g}", kind
            mark = f"{each.method} (chosen)" if each.is_chosen else each.method
            rows.add_row(mark, *numbers, f"{each.response_i:.5g}", f"{each.response_ii:.5g}")
        print_table(rows)
    if out is not None:
        path = curve_figure(points, name).save(out)[0]
        if not as_json:
            console.print("The figure:", path.resolve())


def _print_levels(found: MotionBenchmark) -> None:
    rows = Table(title=f"{found.motion.regime.value}: {found.motion.name}", title_justify="left")
    for heading in ("", "simulated s per s", "error of the state", "of Response I"):
        rows.add_column(heading)
    for level in found.levels:
        first = (
            f"scatter {level.response_i_scatter:.1%}"
            if level.response_i_scatter > 0.0
            else _number(level.response_i_error)
        )
        rows.add_row(level.accuracy.value, f"{1 / level.cost:.0f}", _number(level.state_error), first)
    for solver in found.solvers:
        rows.add_row(f"scipy {solver.name}", f"{1 / solver.cost:.2g}", _number(solver.state_error), "")
    print_table(rows)
    console.print(found.advice)
    console.print()


def _print_shares(lotteries: tuple[LotteryFigures, ...]) -> None:
    rows = Table(title="sensitive to the start: shares of motions", title_justify="left")
    for heading in ("", "Response I", "share stated", "of many starts", "cost over one run"):
        rows.add_column(heading)
    for each in lotteries:
        for stated in each.shares:
            share = stated.motion.share
            rows.add_row(
                each.lottery.name,
                f"{stated.motion.response_i:.4g}",
                f"{share.share:.0%} ({100 * share.low:.0f} to {100 * share.high:.0f} %)",
                f"{stated.of_many:.0%} of {each.starts}",
                f"{each.cost:.1f}",
            )
    print_table(rows)


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.1e}"


def _document(benchmark: AccuracyBenchmark) -> dict[str, object]:
    return {
        "machine": benchmark.machine,
        "software": benchmark.software,
        "motions": [
            {**asdict(each), "name": each.motion.name, "advice": each.advice} for each in benchmark.motions
        ],
        "lotteries": [
            {
                "name": each.lottery.name,
                "answer": each.answered.to_dict(),
                "shares_of_many": [stated.of_many for stated in each.shares],
                "starts": each.starts,
                "cost": each.cost,
            }
            for each in benchmark.lotteries
        ],
        "transients": [
            {**asdict(each), "name": each.motion.name, "promise": each.promise}
            for each in benchmark.transients
        ],
        "promises": [
            {"level": level.value, "promised": level.promise, "worst": benchmark.worst_error(level)}
            for level in Accuracy
        ],
    }
