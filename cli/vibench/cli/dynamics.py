"""`vibench branches`, `vibench spectrum` and `vibench chain`: compute, print, store."""

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from vibench.acquisition.plan import loop_time_s
from vibench.acquisition.rig import load_rig
from vibench.analysis import Curve, CurveKind, InvalidRequest, recorded_response
from vibench.analysis.dynamics import (
    BranchDiagram,
    BranchLine,
    BranchRequest,
    ChainAnswer,
    ChainDrive,
    ChainRequest,
    ChainRun,
    ExponentSpectrum,
    SpectrumRequest,
    branch_lines,
    chain_runs,
    spectrum_points,
    write_chain,
    write_diagram,
    write_spectrum,
)
from vibench.analysis.report import ImageKind
from vibench.sim import Parameter, count_text
from vibench.sim.chain import MOST_CELLS
from vibench.sim.study import software

from .options import Fields, RequestOptions, option
from .output import ExitCode, bold, console, errors, print_json
from .paths import AsJson, room_for_folder
from .progress_bars import watch_interrupt
from .scene_options import SPECIMEN, axis_fields, range_of, read_specimen, specimen_request

if TYPE_CHECKING:
    from vibench.analysis.report import DrawnFigure


Part = TypeVar("Part")
Result = TypeVar("Result", bound="BranchDiagram | ExponentSpectrum | ChainAnswer")
SHOWN = 24
"""Largest number of result rows printed on the terminal; JSON and file contain all rows."""


def carry_out(
    parts: Iterator[Part],
    result_of: Callable[[tuple[Part, ...], float], Result],
    part_in_words: Callable[[int, Part], str],
    result_in_words: Callable[[Result], Iterable[str]],
    write: Callable[[Result, Path], object],
    draw: "Callable[[Result], DrawnFigure]",
    file: Path | None,
    *,
    as_json: bool,
) -> None:
    """Compute all parts, print each part and the result, and write the file and its figure if requested.

    ``result_of`` receives the parts and the elapsed time [s]. If a file cannot be written at the end, the
    result is printed as JSON. After Ctrl-C, the result contains the parts computed so far, and the exit code
    is `STOPPED`.
    """
    if file is not None:
        room_for_folder(file.parent)
        if file.exists():
            raise InvalidRequest(f"{file} exists, and nothing is ever overwritten; choose another folder")
    found, elapsed_s, is_complete = _compute(parts, part_in_words, is_silent=as_json)
    result = result_of(found, elapsed_s)
    has_all = is_complete and (not isinstance(result, BranchDiagram) or result.is_complete)
    document = {**result.to_dict(), "is_complete": has_all, "software": software()}
    if as_json:
        print_json(document)
    else:
        for line in result_in_words(result):
            console.print(line)
    if file is not None:
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            write(result, file)
            drawn = draw(result).save(file.parent, (ImageKind.PNG, ImageKind.SVG))
        except (InvalidRequest, OSError) as error:
            if not as_json:
                print_json(document)
            raise InvalidRequest(f"{error}; the JSON on standard output contains the whole result") from error
        if not as_json:
            console.print("The figure:", bold(drawn[0].resolve()))
    if not is_complete:
        errors.print("stopped: the result contains the parts computed so far")
        raise typer.Exit(ExitCode.STOPPED)


def _compute(
    parts: Iterator[Part], in_words: Callable[[int, Part], str], *, is_silent: bool
) -> tuple[tuple[Part, ...], float, bool]:
    """Return all parts, the elapsed time [s], and whether the computation was complete (no Ctrl-C)."""
    found: list[Part] = []
    began = time.perf_counter()
    is_complete = True
    try:
        with watch_interrupt() as is_stopped:
            while is_complete and (part := next(parts, None)) is not None:
                found.append(part)
                if not is_silent and (line := in_words(len(found), part)):
                    console.print(line)
                is_complete = not is_stopped()
    except ValueError as error:
        raise InvalidRequest(str(error)) from error
    return tuple(found), time.perf_counter() - began, is_complete


BRANCHES_FILE = "branches.h5"
BRANCH_OPTIONS = (
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
        option("Base displacement amplitude, or a range along which to follow branches.", "M|START:STOP"),
    ] = None,
    frequency: Annotated[
        str | None, option("Drive frequency [Hz], or a range along which to follow branches.", "F|START:STOP")
    ] = None,
    like: Annotated[
        Path | None,
        option("Use range, level and specimen of this stepped sine or sweep, and draw it.", "RECORDING.h5"),
    ] = None,
    resonance: Annotated[
        str | None,
        option(
            "Between these frequencies [Hz], follow the phase resonance of the mode over the amplitude.",
            "LOW:HIGH",
        ),
    ] = None,
    *,
    options: Annotated[RequestOptions[BranchRequest], Fields(BRANCH_OPTIONS)],
    holdable: Annotated[
        Path | None,
        option("Report which unstable motions the feedback of this bench can hold.", "BENCH.toml"),
    ] = None,
    out: Annotated[Path | None, option("Folder for branches.h5, figure and tables.", "DIR")] = None,
    as_json: AsJson = False,
) -> None:
    """Find stable and unstable periodic motions, and follow them over frequency or level to bifurcations."""
    if resonance is None:
        measured, drive = _branch_drive(amplitude, frequency, like)
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

    if not as_json:
        console.print("Searching for motions; each branch is printed when it is found.")
    carry_out(
        branch_lines(request),
        lambda lines, elapsed_s: BranchDiagram(request, lines, elapsed_s),
        lambda number, line: _branch_in_words(number, line, request.along),
        lambda diagram: [f"{diagram.cost_sentence} {diagram.holding_sentence}".rstrip()],
        write_diagram,
        lambda diagram: branches_figure(diagram, measured),
        out and out / BRANCHES_FILE,
        as_json=as_json,
    )


def _branch_drive(
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
    undecided = float((~(line.is_stable | line.is_unstable)).mean())
    stability = f"{line.is_stable.mean():.0%} stable" + f", {undecided:.0%} undecided" * (undecided > 0.0)
    return (
        f"{number}: period {line.periods}, {line.shape}{isolated}: {place.min():.5g} to "
        f"{place.max():.5g} {unit}, {count_text(line.points, 'motion')}, {stability}, "
        f"{line.elapsed_s:.1f} s" + (f"; {named} {unit}" if named else "")
    )


SPECTRUM_FILE = "spectrum.h5"
SPECTRUM_OPTIONS = (*SPECIMEN, "duration_s", "settle_s", "accuracy", "confidence")


def spectrum(
    amplitude: Annotated[str, option("Amplitude of the base displacement.", "M|START:STOP:STEP")],
    frequency: Annotated[str, option("One drive frequency or a range [Hz].", "F|START:STOP:STEP")],
    options: Annotated[RequestOptions[SpectrumRequest], Fields(SPECTRUM_OPTIONS)],
    out: Annotated[Path | None, option("Folder for spectrum.h5, figure and table.", "DIR")] = None,
    as_json: AsJson = False,
) -> None:
    """Compute all Lyapunov exponents over frequency or level, their sum, and the Kaplan-Yorke dimension."""
    a, f = range_of(amplitude, Parameter.AMPLITUDE, (1, 3)), range_of(frequency, Parameter.FREQUENCY, (1, 3))
    if a.stop is not None and f.stop is not None:
        raise InvalidRequest(
            "--amplitude and --frequency were both given as ranges; give one of them as one number"
        )
    drive = axis_fields(a, f) | {"step": a.step or f.step or 1.0}
    request = specimen_request(options, options.typed.get("specimen"), amplitude, None, **drive)
    from vibench.analysis.report import exponent_spectrum_figure

    carry_out(
        spectrum_points(request),
        lambda points, elapsed_s: ExponentSpectrum(request, points, elapsed_s),
        lambda _number, _point: "",
        _spectrum_in_words,
        write_spectrum,
        exponent_spectrum_figure,
        out and out / SPECTRUM_FILE,
        as_json=as_json,
    )


def _spectrum_in_words(found: ExponentSpectrum) -> Iterator[str]:
    along = found.request.along
    yield f"All exponents [1/s] with {found.request.confidence:.0%} intervals: {found.request.title}"
    step = max(1, -(-len(found.points) // SHOWN))
    for each in found.points[::step]:
        place = (
            f"{each.frequency_hz:g} Hz" if along is Parameter.FREQUENCY else f"{1e6 * each.amplitude_m:g} µm"
        )
        six = ", ".join(
            f"{value:.4g} ± {0.5 * (high - low):.2g}"
            for value, low, high in zip(each.exponents_per_s, each.low_per_s, each.high_per_s, strict=True)
        )
        yield (
            f"{place}: {six}; sum {each.sum_per_s:.9g}; dimension {each.dimension:.3g} "
            f"({each.dimension_low:.3g} to {each.dimension_high:.3g}); {each.observation}"
        )
    if step > 1:
        yield f"one in {step} points is shown (of {len(found.points)}); --json or --out gives all points"
    yield found.cost_sentence


CHAIN_FILE = "chain.h5"
CHAIN_OPTIONS = (*SPECIMEN[1:], "duration_s", "settle_s", "exponent_s", "accuracy", "error", "time_s")
_SWEEP_ENDS, _CHANGED = 2, 1e-3


def chain(
    cells: Annotated[str, option("Number of cells; several numbers for a study.", "N|N,N,...")] = "8",
    amplitude: Annotated[str | None, option("Amplitude of the base displacement.", "M")] = None,
    frequency: Annotated[
        str | None,
        option(
            "One or several steady frequencies [Hz]; START:STOP is a sweep, up or down.",
            "F|START:STOP:STEP|START:STOP",
        ),
    ] = None,
    recording: Annotated[Path | None, option("Recorded base motion as drive.", "RECORDING.h5")] = None,
    specimen: Annotated[
        list[str] | None,
        option(
            "Specimen file, or a name listed by `vibench specimen`; repeat --specimen for alternating cells.",
            "NAME|CHAIN_FILE.toml",
        ),
    ] = None,
    *,
    options: Annotated[RequestOptions[ChainRequest], Fields(CHAIN_OPTIONS)],
    out: Annotated[Path | None, option("Folder for chain.h5, figure and tables.", "DIR")] = None,
    as_json: AsJson = False,
) -> None:
    """Simulate a chain of cells: band gaps, transmission, energy, impacts and exponents of each cell."""
    first, *others = specimen or (None,)
    request = specimen_request(
        options,
        first,
        amplitude,
        recording,
        others=tuple(read_specimen(each) for each in others),
        lengths=_lengths(cells),
        **_chain_drive(amplitude, frequency, recording),
    )
    from vibench.analysis.report import chain_figure

    carry_out(
        chain_runs(request),
        lambda runs, elapsed_s: ChainAnswer(request, runs, elapsed_s),
        lambda _number, run: _run_in_words(run),
        lambda found: [found.cost_sentence],
        write_chain,
        chain_figure,
        out and out / CHAIN_FILE,
        as_json=as_json,
    )


def _lengths(text: str) -> tuple[int, ...]:
    parts = text.split(",") if text.isascii() else [""]
    if not all(part.strip().isdecimal() and 1 <= int(part) <= MOST_CELLS for part in parts):
        raise InvalidRequest(
            f"--cells was given as {text!r}; give a whole number from 1 to {MOST_CELLS}, "
            "or several such as 1,2,4,8"
        )
    return tuple(map(int, parts))


def _chain_drive(amplitude: str | None, frequency: str | None, recording: Path | None) -> dict[str, object]:
    """Return the request's fields for the base motion; if no option sets a motion, the base is at rest."""
    if recording is not None:
        if amplitude is not None or frequency is not None:
            raise InvalidRequest(
                "--recording was given, which defines the base motion; leave out --amplitude and --frequency"
            )
        return {"drive": ChainDrive.RECORDED, "recording": str(recording)}
    if frequency is None and amplitude is None:
        return {"drive": ChainDrive.NONE}
    if frequency is None or amplitude is None:
        raise InvalidRequest(
            "one of --amplitude and --frequency is missing; give both, or neither for a chain without contact"
        )
    level = {"amplitude_m": range_of(amplitude, Parameter.AMPLITUDE, (1,)).start}
    ends = frequency.split(":")
    if len(ends) == _SWEEP_ENDS:
        with suppress(ValueError):
            ends.sort(key=float)
        range_of(":".join(ends), Parameter.FREQUENCY, (2,))
        start, stop = map(float, frequency.split(":"))
        return {**level, "drive": ChainDrive.SWEPT, "start_hz": start, "stop_hz": stop}
    steady = range_of(frequency, Parameter.FREQUENCY, (1, 3))
    step = {} if steady.step is None else {"step_hz": steady.step}
    return {**level, "start_hz": steady.start, "stop_hz": steady.stop or steady.start, **step}


def _run_in_words(run: ChainRun) -> str:
    """Return the result of one run as a line of text, with values of the first and the last cell."""
    where = "" if math.isnan(run.frequency_hz) else f" at {run.frequency_hz:g} Hz"
    first, last = run.transmission[0, 0], run.transmission[0, -1]
    across = "" if len(run.over_hz) > 1 else f"|x/U| {first:.4g} in the first cell, {last:.4g} in the last; "
    if run.target is not None:
        across += f"error: {run.target.text}; "
    elif (change := run.transmission_change.max()) > _CHANGED:
        across += f"not settled, or chaotic: |x/U| later changes by {100.0 * change:.2g} %; "
    known = f"; exponent {run.exponent_per_s:.4g} ± {run.exponent_error_per_s:.2g} 1/s"
    exponent = "" if math.isnan(run.exponent_per_s) else known
    if not run.time_s.size:
        return f"{count_text(run.cells, 'cell')}{where}: {run.outcome}, {run.elapsed_s:.1f} s"
    rates = run.impacts / run.observed_s
    return (
        f"{count_text(run.cells, 'cell')}{where}: {across}impacts per second {rates[0]:.4g} in the first cell"
        f", {rates[-1]:.4g} in the last; mean energy {1e6 * run.energy_j[0]:.4g} µJ in the first cell, "
        f"{1e6 * run.energy_j[-1]:.4g} µJ in the last{exponent}; {run.outcome}, {run.elapsed_s:.1f} s"
    )
