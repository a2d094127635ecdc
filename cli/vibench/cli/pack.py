"""`vibench pack`: a campaign's folder as one zip with a description, to be deposited as it is."""

from pathlib import Path
from typing import Annotated

import typer

from vibench.analysis.exchange import CrateFacts, pack_folder

from .output import console
from .progress_bars import transfer_bar


def pack(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Recordings, and what lies beside them.")],
    licence: Annotated[
        str, typer.Option("--license", metavar="URL", help="https://creativecommons.org/licenses/by/4.0/")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="CRATE.zip", help="DIR.zip beside it if absent.")
    ] = None,
    author: Annotated[
        list[str] | None, typer.Option("--author", metavar="NAME", help="May be given several times.")
    ] = None,
    title: Annotated[str, typer.Option("--title", help="The folder's name if absent.")] = "",
    description: Annotated[str, typer.Option("--description", help="A sentence or two.")] = "",
) -> None:
    """Pack a folder of recordings as a Research Object Crate, described for a repository."""
    here = folder.resolve()
    # Not with_suffix: a folder may be called after a level, "0.5Vpp".
    crate = here.with_name(f"{here.name}.zip") if out is None else out
    facts = CrateFacts(licence, tuple(author or ()), title, description)
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    with transfer_bar("pack", size) as observer:
        packed = pack_folder(folder, crate, facts, observer)
    console.print(f"packed {len(packed)} files into {crate}")
