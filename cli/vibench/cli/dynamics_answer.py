"""Common functions of the commands for branches, exponents and chains: compute, print, store."""

import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import typer

from vibench.analysis import InvalidRequest
from vibench.analysis.report import ImageKind
from vibench.sim.study import software

from .interruption import watch_interrupt
from .output import ExitCode, bold, console, errors, print_json
from .paths import room_for_folder

if TYPE_CHECKING:
    from vibench.analysis.report import DrawnFigure

Part = TypeVar("Part")
SHOWN = 24
"""Largest number of result rows printed on the terminal; JSON and file contain all rows."""


def room_for(file: str, out: Path | None) -> None:
    """Check, before computing, that the folder can be written to and contains no result yet."""
    if out is None:
        return
    room_for_folder(out)
    if (out / file).exists():
        raise InvalidRequest(f"{out / file} exists, and nothing is ever overwritten; choose another folder")


def compute_parts(
    parts: Iterator[Part], tell: Callable[[int, Part], None]
) -> tuple[tuple[Part, ...], float, bool]:
    """Compute all parts of a result and report each finished part; at Ctrl-C, stop after the current part.

    Return the parts, the elapsed time [s], and whether all parts were computed.
    """
    found: list[Part] = []
    began = time.perf_counter()
    is_complete = True
    try:
        with watch_interrupt() as is_stopped:
            for part in parts:
                found.append(part)
                tell(len(found), part)
                if is_stopped():
                    is_complete = False
                    break
    except ValueError as error:
        raise InvalidRequest(str(error)) from error
    return tuple(found), time.perf_counter() - began, is_complete


def keep(
    out: Path | None,
    write: Callable[[Path], object],
    draw: "Callable[[], DrawnFigure]",
    *,
    is_path_printed: bool,
) -> None:
    """Write the results, their figure and the figure's tables into the folder that the user gave, if any."""
    if out is None:
        return
    out.mkdir(parents=True, exist_ok=True)
    write(out)
    drawn = draw().save(out, (ImageKind.PNG, ImageKind.SVG))
    if is_path_printed:
        console.print("The figure:", bold(drawn[0].resolve()))


def print_answer(document: Mapping[str, object], *, is_complete: bool) -> None:
    """Print a result as JSON, with the versions of the software."""
    print_json({**document, "is_complete": is_complete, "software": software()})


def leave(*, is_complete: bool) -> None:
    """Exit with the code `STOPPED` if the computation was stopped before all parts were finished."""
    if not is_complete:
        errors.print("stopped: the result contains the parts computed so far")
        raise typer.Exit(ExitCode.STOPPED)
