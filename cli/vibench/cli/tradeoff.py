"""`vibench tradeoff`: error against computing time of every method, for a scene or the paper's cases."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

from rich.table import Table

from vibench.analysis import InvalidRequest
from vibench.analysis.dynamics import SpecimenChoice
from vibench.sim import Rest
from vibench.sim.accuracy_benchmark.curve import CurvePoint, scene_curve
from vibench.sim.study import Study

from .options import Fields, RequestOptions, build_request, option
from .output import console, print_json, print_table
from .paper.options import AMPLITUDES_M
from .paths import AsJson, room_for_folder
from .specimen_option import AXES, SPECIMEN, read_specimen

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
    scenes = {"amplitude": amplitude, "frequency": frequency}
    scenes = {name: value for name, value in scenes.items() if value is not None}
    if len(scenes) == 1:
        raise InvalidRequest("a scene needs both --amplitude and --frequency; one of them is missing")
    amplitudes_m = (amplitude,) if amplitude is not None else AMPLITUDES_M
    studies = [
        _study(each_m, frequency or _PAPER_HZ, choice.typed, target.typed or {"error": "1 %"})
        for each_m in amplitudes_m
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
        print_json(found[0] if scenes else {"scenes": found})
    if out is not None:
        from vibench.analysis.report import curve_figure

        path = curve_figure(curves).save(out)[0]
        if not as_json:
            console.print("The figure:", path.resolve())


def _study(
    amplitude_m: float, frequency_hz: float, typed: Mapping[str, Any], target: Mapping[str, Any]
) -> Study:
    return build_request(
        Study,
        {
            "specimen": read_specimen(typed.get("specimen")),
            **{axis: (typed[name],) for axis, name in AXES.items() if name in typed},
            "amplitudes_m": (amplitude_m,),
            "frequencies_hz": (frequency_hz,),
            **target,
        },
    )


def _print_curve(name: str, points: list[CurvePoint]) -> None:
    rows = Table(title=f"error against computing time: {name}", title_justify="left")
    for heading in ("method", "time [s]", "error", "", "Response I", "II"):
        rows.add_column(heading)
    for each in points:
        kind = "stated" if each.is_stated else "against the best"
        numbers = f"{each.time_s:.2g}", f"{each.error:.1g}", kind
        mark = f"{each.method} (chosen)" if each.is_chosen else each.method
        rows.add_row(mark, *numbers, f"{each.response_i:.5g}", f"{each.response_ii:.5g}")
    print_table(rows)
