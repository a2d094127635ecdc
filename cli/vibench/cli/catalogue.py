"""`vibench catalogue`: list the recordings of a folder."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition.campaign import CatalogueEntry, Refresh, list_recordings

from .options import option
from .output import ExitCode, console, errors, print_json
from .paths import AllowExternal, AsJson

COLUMNS = ("recording", "started (UTC)", "excitation", "level", "frequency", "length", "size", "verdict")


def show_catalogue(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of recordings.")],
    rebuild: Annotated[bool, option("Read all files again, not only the changed ones.")] = False,
    _allow_external: AllowExternal = False,
    as_json: AsJson = False,
) -> None:
    """List the recordings of a folder and its subfolders: excitation, date, outcome, size."""
    entries = list_recordings(folder, Refresh.ALL if rebuild else Refresh.CHANGED)
    if as_json:
        print_json({"folder": str(folder.resolve()), "recordings": [asdict(each) for each in entries]})
    elif entries:
        _show(entries)
    else:
        console.print(f"{folder} contains no recordings")
    for each in entries:
        if each.is_bad:
            where = "" if each.path in each.reason else f"{each.path}: "
            errors.print(f"error: {where}{each.reason}")
    if any(each.is_bad for each in entries):
        raise typer.Exit(ExitCode.FAILED)


def _show(entries: Sequence[CatalogueEntry]) -> None:
    rows = [COLUMNS, *(_row(each) for each in entries)]
    widths = [max(len(row[column]) for row in rows) for column in range(len(COLUMNS))]
    for row in rows:
        line = "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        console.print(line.rstrip())


def _row(entry: CatalogueEntry) -> tuple[str, ...]:
    return (
        entry.path,
        entry.started_utc[:19].replace("T", " "),
        entry.kind.replace("_", " "),
        "" if entry.amplitude_vpp is None else f"{entry.amplitude_vpp:g} Vpp",
        _band(entry),
        "" if entry.duration_s is None else f"{entry.duration_s:.1f} s",
        f"{entry.size_bytes / 1e6:.1f} MB",
        entry.verdict,
    )


def _band(entry: CatalogueEntry) -> str:
    low_hz, high_hz = entry.frequency_low_hz, entry.frequency_high_hz
    if low_hz is None:
        return ""
    return f"{low_hz:g} Hz" if low_hz == high_hz else f"{low_hz:g} to {high_hz:g} Hz"
