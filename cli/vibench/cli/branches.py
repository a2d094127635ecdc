"""`vibench branches`: periodic motions over frequency or level, stable and unstable."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from vibench.acquisition.plan import loop_time_s
from vibench.acquisition.rig import load_rig
from vibench.analysis import Curve, CurveKind, InvalidRequest, recorded_response
from vibench.analysis.dynamics import BranchDiagram, BranchLine, BranchRequest, branch_lines, write_diagram
from vibench.sim import Parameter, count_text

from .dynamics_answer import compute_parts, keep, leave, print_answer, room_for
from .options import Fields, RequestOptions, option
from .output import console
from .paths import AsJson
from .range_option import axis_fields, range_of
from .specimen_option import SPECIMEN, specimen_request

FILE = "branches.h5"
OPTIONS = (
    "method",
    *SPECIMEN,
    "harmonics",
    "places",
    "starts",
    "most_periods",
    "seed",
    "phase_of",
    "error",
    "time_s",
)


def branches(
    amplitude: Annotated[
        str | None,
        option("Amplitude of the base displacement, or a range to follow branches along.", "M|START:STOP"),
    ] = None,
    frequency: Annotated[
        str | None, option("Drive frequency [Hz], or a range to follow branches along.", "F|START:STOP")
    ] = None,
    like: Annotated[
        Path | None,
        option("Use range, level and specimen of this stepped sine or sweep; draw it too.", "RECORDING.h5"),
    ] = None,
    resonance: Annotated[
        str | None,
        option(
            "Follow the phase resonance of the mode between these frequencies [Hz] over the amplitude.",
            "LOW:HIGH",
        ),
    ] = None,
    *,
    options: Annotated[RequestOptions[BranchRequest], Fields(OPTIONS)],
    holdable: Annotated[
        Path | None,
        option("Report which unstable motions the feedback of this bench can hold.", "BENCH.toml"),
    ] = None,
    out: Annotated[Path | None, option("Folder for branches.h5, figure and tables.", "DIR")] = None,
    as_json: AsJson = False,
) -> None:
    """Find stable and unstable periodic motions, and follow them over frequency or level to bifurcations."""
    if resonance is None:
        measured, drive = _drive(amplitude, frequency, like)
    else:
        measured, drive = _resonance(amplitude, frequency, like, resonance)
    request = specimen_request(options, options.typed.get("specimen"), amplitude, like, **drive)
    if holdable is not None:
        lowest_hz = request.start if request.along is Parameter.FREQUENCY else request.frequency_hz
        if request.resonance_band_hz is not None:
            lowest_hz = request.resonance_band_hz[0]
        rig = load_rig(holdable)
        loop_s = loop_time_s(rig, lowest_hz) if rig.controller is None else rig.controller.loop_time_s
        request = request.model_copy(update={"loop_time_s": loop_s})
    from vibench.analysis.report import branches_figure

    room_for(FILE, out)
    if not as_json:
        console.print("Searching for motions; each branch is printed when it is found.")

    def print_branch(number: int, line: BranchLine) -> None:
        if not as_json:
            console.print(_branch_in_words(number, line, request.along))

    lines, elapsed_s, is_complete = compute_parts(branch_lines(request), print_branch)
    diagram = BranchDiagram(request, lines, elapsed_s)
    if as_json:
        print_answer(diagram.to_dict(), is_complete=is_complete and diagram.is_complete)
    else:
        console.print(f"{diagram.cost_sentence} {diagram.holding_sentence}".rstrip())
    keep(
        out,
        lambda folder: write_diagram(diagram, folder / FILE),
        lambda: branches_figure(diagram, measured),
        is_path_printed=not as_json,
    )
    leave(is_complete=is_complete)


def _drive(
    amplitude: str | None, frequency: str | None, like: Path | None
) -> tuple[Sequence[Curve], dict[str, object]]:
    """Return the measured curves to overlay, and the request's fields for parameter range and level."""
    if like is not None:
        if amplitude is not None:
            raise InvalidRequest(
                f"--amplitude {amplitude} and --like were both given, but the recording defines the "
                "amplitude; leave out --amplitude (--frequency START:STOP is allowed, within the "
                "range of the recording)"
            )
        recorded = recorded_response(like, tuple(CurveKind))
        curves, level = recorded.measured, recorded.pairs
        low, high = level[0][0], level[-1][0]
        if frequency is not None:
            chosen = range_of(frequency, Parameter.FREQUENCY, (2,))
            low, high = chosen.start, chosen.stop or high
        return curves, {"along": Parameter.FREQUENCY, "recorded_level": level, "start": low, "stop": high}
    if amplitude is None or frequency is None:
        raise InvalidRequest(
            "--amplitude or --frequency is missing; give both, one as a range START:STOP, or give --like"
        )
    a, f = range_of(amplitude, Parameter.AMPLITUDE, (1, 2)), range_of(frequency, Parameter.FREQUENCY, (1, 2))
    if (a.stop is None) == (f.stop is None):
        raise InvalidRequest(
            f"--amplitude was given as {amplitude!r} and --frequency as {frequency!r}; give one of them as a "
            "range START:STOP and the other as one number"
        )
    return (), axis_fields(a, f)


def _resonance(
    amplitude: str | None, frequency: str | None, like: Path | None, resonance: str
) -> tuple[Sequence[Curve], dict[str, object]]:
    """Return no measured curves, and the request's fields for following a phase resonance over amplitude."""
    if amplitude is None or frequency is not None or like is not None:
        raise InvalidRequest(
            f"--resonance {resonance} is followed over the amplitude; also give --amplitude START:STOP, and "
            "leave out --frequency and --like"
        )
    band = range_of(resonance, Parameter.FREQUENCY, (2,), "resonance")
    levels = range_of(amplitude, Parameter.AMPLITUDE, (2,))
    return (), {
        "along": Parameter.AMPLITUDE,
        "resonance_band_hz": (band.start, band.stop),
        "start": levels.start,
        "stop": levels.stop,
    }


def _branch_in_words(number: int, line: BranchLine, along: Parameter) -> str:
    scale, unit = (1.0, "Hz") if along is Parameter.FREQUENCY else (1e6, "µm")
    place = scale * line.axis_values(along)
    named = ", ".join(
        f"{each.kind} {scale * (each.frequency_hz if along is Parameter.FREQUENCY else each.amplitude_m):.5g}"
        for each in line.events
    )
    isolated = ", isolated" if line.is_isolated else ""
    return (
        f"{number}: period {line.periods}, {line.shape}{isolated}: {place.min():.5g} to "
        f"{place.max():.5g} {unit}, {count_text(line.points, 'motion')}, {line.is_stable.mean():.0%} stable, "
        f"{line.elapsed_s:.1f} s" + (f"; {named} {unit}" if named else "")
    )
