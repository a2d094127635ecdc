"""`vibench branches`: periodic motions over frequency or level, stable and unstable."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from vibench.analysis import (
    Curve,
    CurveOrigin,
    FrequencyResponseRequest,
    InvalidRequest,
    Simulation,
    compare_recording,
    level_of_drive,
)
from vibench.analysis.dynamics import (
    BranchDiagram,
    BranchLine,
    BranchMethod,
    BranchRequest,
    branch_lines,
    write_diagram,
)
from vibench.analysis.report import ImageKind, branches_figure
from vibench.sim import Parameter
from vibench.sim.study import software

from .interruption import told_to_stop
from .output import bold, console, print_json
from .paths import AsJson, room_for_folder
from .range_option import Range, range_of
from .specimen_option import DampingTime, Gap, LawOption, SpecimenOption, asked_of_specimen
from .study import STOPPED_EXIT_CODE

FILE = "branches.h5"


def branches(
    amplitude: Annotated[
        str | None,
        typer.Option(
            "--amplitude", metavar="M|START:STOP", help="Of the base displacement; a range to go along it."
        ),
    ] = None,
    frequency: Annotated[
        str | None,
        typer.Option(
            "--frequency", metavar="F|START:STOP", help="Of the drive [Hz]; a range to go along it."
        ),
    ] = None,
    like: Annotated[
        Path | None,
        typer.Option(
            "--like",
            metavar="RECORDING.h5",
            help="Take range and level from a stepped sine or sweep, and lay the branches over it.",
        ),
    ] = None,
    method: Annotated[
        BranchMethod,
        typer.Option("--method", help="Exact; harmonic balance; or with one harmonic, the paper's eq. 5."),
    ] = BranchMethod.SHOOTING,
    specimen: SpecimenOption = None,
    model: LawOption = None,
    damping_time: DampingTime = None,
    gap: Gap = None,
    harmonics: Annotated[
        int, typer.Option("--harmonics", metavar="N", help="Highest that a balance may use.")
    ] = 511,
    places: Annotated[
        int, typer.Option("--places", metavar="N", help="Values in the range where motions are looked for.")
    ] = 8,
    starts: Annotated[
        int, typer.Option("--starts", metavar="N", help="Random states at each: isolated branches need them.")
    ] = 12,
    most_periods: Annotated[
        int, typer.Option("--most-periods", metavar="N", help="Longest motion looked for, in drive periods.")
    ] = 4,
    seed: Annotated[int, typer.Option("--seed", help="Of the random states.")] = 1,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Folder for branches.h5, figure and tables.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Find and follow periodic motions over frequency or level, stable and unstable; name bifurcations."""
    measured, drive = _drive(amplitude, frequency, like)
    asked = asked_of_specimen(
        BranchRequest,
        specimen,
        model,
        damping_time,
        gap,
        method=method,
        harmonics=harmonics,
        places=places,
        starts=starts,
        most_periods=most_periods,
        seed=seed,
        **drive,
    )
    if out is not None:
        room_for_folder(out)
        if (out / FILE).exists():
            raise InvalidRequest(
                f"{out / FILE} exists, and nothing is ever overwritten; choose another folder"
            )
    diagram, is_complete = _computed(asked, is_told=not as_json)
    if as_json:
        print_json({**diagram.to_dict(), "is_complete": is_complete, "software": software()})
    else:
        console.print(diagram.cost_sentence)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        write_diagram(diagram, out / FILE)
        drawn = branches_figure(diagram, measured).save(out, (ImageKind.PNG, ImageKind.SVG))
        if not as_json:
            console.print("The figure:", bold(drawn[0].resolve()))
    if not is_complete:
        raise typer.Exit(STOPPED_EXIT_CODE)


def _drive(
    amplitude: str | None, frequency: str | None, like: Path | None
) -> tuple[Sequence[Curve], dict[str, object]]:
    """Read along what the branches go, and at what level."""
    if like is not None:
        if amplitude is not None:
            raise InvalidRequest("--amplitude and --like were both given; the recording has its own level")
        curves, level = _recorded(like)
        low, high = level[0][0], level[-1][0]
        if frequency is not None:
            chosen = range_of(frequency, Parameter.FREQUENCY, (2,))
            low, high = chosen.start, chosen.stop or high
        return curves, {"along": Parameter.FREQUENCY, "recorded_level": level, "start": low, "stop": high}
    if amplitude is None or frequency is None:
        raise InvalidRequest(
            "--amplitude or --frequency is missing; give both, one of them as a range START:STOP, or --like"
        )
    a, f = range_of(amplitude, Parameter.AMPLITUDE, (1, 2)), range_of(frequency, Parameter.FREQUENCY, (1, 2))
    if (a.stop is None) == (f.stop is None):
        raise InvalidRequest(
            f"--amplitude was given as {amplitude!r} and --frequency as {frequency!r}; give one of them as a "
            "range START:STOP and the other as one number"
        )
    return (), _along(a, f)


def _along(amplitude: Range, frequency: Range) -> dict[str, object]:
    if frequency.stop is not None:
        return {
            "along": Parameter.FREQUENCY,
            "amplitude_m": amplitude.start,
            "start": frequency.start,
            "stop": frequency.stop,
        }
    return {
        "along": Parameter.AMPLITUDE,
        "frequency_hz": frequency.start,
        "start": amplitude.start,
        "stop": amplitude.stop,
    }


def _recorded(path: Path) -> tuple[Sequence[Curve], tuple[tuple[float, float], ...]]:
    found = compare_recording(path, FrequencyResponseRequest(), Simulation.LEFT_OUT)
    return [each for each in found.curves if each.origin is CurveOrigin.MEASURED], level_of_drive(found)


def _computed(asked: BranchRequest, *, is_told: bool) -> tuple[BranchDiagram, bool]:
    """Compute branch by branch, telling each; Ctrl-C ends after the one under way, and keeps them."""
    lines: list[BranchLine] = []
    began = time.perf_counter()
    is_complete = True
    if is_told:
        console.print("Looking for motions; each branch is told as it is found.")
    with told_to_stop() as is_stopped:
        for line in branch_lines(asked):
            lines.append(line)
            if is_told:
                console.print(_told(len(lines), line, asked.along))
            if is_stopped():
                is_complete = False
                break
    return BranchDiagram(asked, tuple(lines), time.perf_counter() - began), is_complete


def _told(number: int, line: BranchLine, along: Parameter) -> str:
    scale, unit = (1.0, "Hz") if along is Parameter.FREQUENCY else (1e6, "µm")
    place = scale * line.along(along)
    named = ", ".join(
        f"{each.kind} {scale * (each.frequency_hz if along is Parameter.FREQUENCY else each.amplitude_m):.5g}"
        for each in line.events
    )
    isolated = ", isolated" if line.is_isolated else ""
    return (
        f"{number}: period {line.periods}, {line.shape}{isolated}: {place.min():.5g} to "
        f"{place.max():.5g} {unit}, {line.points} motions, {line.is_stable.mean():.0%} stable, "
        f"{line.elapsed_s:.1f} s" + (f"; {named} {unit}" if named else "")
    )
