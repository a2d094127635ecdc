"""`vibench chain`: waves, band gaps, transmission, energy, impacts and exponents of a chain of cells."""

import math
from pathlib import Path
from typing import Annotated

from vibench.analysis import InvalidRequest
from vibench.analysis.dynamics import (
    ChainAnswer,
    ChainDrive,
    ChainRequest,
    ChainRun,
    chain_runs,
    write_chain,
)
from vibench.sim import Parameter, count_text
from vibench.sim.chain import MOST_CELLS

from .dynamics_answer import compute_parts, keep, leave, print_answer, room_for
from .options import Fields, RequestOptions, option
from .output import console
from .paths import AsJson
from .range_option import range_of
from .specimen_option import SPECIMEN, read_specimen, specimen_request

FILE = "chain.h5"
OPTIONS = (*SPECIMEN[1:], "duration_s", "settle_s", "exponent_s", "accuracy", "error", "time_s")
_SWEEP_ENDS = 2


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
            "NAME|FILE.toml",
        ),
    ] = None,
    *,
    options: Annotated[RequestOptions[ChainRequest], Fields(OPTIONS)],
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
        **_drive(amplitude, frequency, recording),
    )
    from vibench.analysis.report import chain_figure

    room_for(FILE, out)

    def print_run(_number: int, run: ChainRun) -> None:
        if not as_json:
            console.print(_run_in_words(run))

    runs, elapsed_s, is_complete = compute_parts(chain_runs(request), print_run)
    found = ChainAnswer(request, runs, elapsed_s)
    if as_json:
        print_answer(found.to_dict(), is_complete=is_complete)
    else:
        console.print(found.cost_sentence)
    keep(
        out,
        lambda folder: write_chain(found, folder / FILE),
        lambda: chain_figure(found),
        is_path_printed=not as_json,
    )
    leave(is_complete=is_complete)


def _lengths(text: str) -> tuple[int, ...]:
    parts = text.split(",") if text.isascii() else [""]
    if not all(part.strip().isdecimal() and 1 <= int(part) <= MOST_CELLS for part in parts):
        raise InvalidRequest(
            f"--cells was given as {text!r}; give a whole number from 1 to {MOST_CELLS}, "
            "or several such as 1,2,4,8"
        )
    return tuple(map(int, parts))


def _drive(amplitude: str | None, frequency: str | None, recording: Path | None) -> dict[str, object]:
    """Return the request's fields for the base motion; if no option sets it, the base is at rest."""
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
        is_downwards = _is_above(*ends)
        swept = range_of(":".join(reversed(ends)) if is_downwards else frequency, Parameter.FREQUENCY, (2,))
        low, high = swept.start, swept.stop or swept.start
        start, stop = (high, low) if is_downwards else (low, high)
        return {**level, "drive": ChainDrive.SWEPT, "start_hz": start, "stop_hz": stop}
    steady = range_of(frequency, Parameter.FREQUENCY, (1, 3))
    step = {} if steady.step is None else {"step_hz": steady.step}
    return {**level, "start_hz": steady.start, "stop_hz": steady.stop or steady.start, **step}


def _is_above(first: str, second: str) -> bool:
    try:
        return float(first) > float(second)
    except ValueError:
        return False


def _run_in_words(run: ChainRun) -> str:
    """Return the result of one run as a line of text, with values of the first and the last cell."""
    where = "" if math.isnan(run.frequency_hz) else f" at {run.frequency_hz:g} Hz"
    first, last = run.transmission[0, 0], run.transmission[0, -1]
    across = "" if len(run.over_hz) > 1 else f"|x/U| {first:.4g} in the first cell, {last:.4g} in the last; "
    if run.target is not None:
        across += f"error: {run.target.text}; "
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
