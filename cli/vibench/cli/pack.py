"""`vibench pack`: a campaign's folder as one zip with a description, to be deposited as it is."""

from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition.campaign import verify_recordings
from vibench.acquisition.recording import SealState, seal_key
from vibench.analysis.exchange import CrateFacts, pack_folder

from .exit_code import ExitCode
from .options import option
from .output import console, errors, leave_output_to_json, print_json
from .paths import AsJson, file_at
from .progress_bars import transfer_bar


def pack(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Recordings, and what lies beside them.")],
    licence: Annotated[str, option("https://creativecommons.org/licenses/by/4.0/", "URL", name="--license")],
    out: Annotated[
        Path | None, option("Or a folder for it; DIR.zip beside it if absent.", "CRATE.zip")
    ] = None,
    author: Annotated[list[str] | None, option("May be given several times.", "NAME")] = None,
    title: Annotated[str, option("The folder's name if absent.")] = "",
    description: Annotated[str, option("A sentence or two.")] = "",
    organisation: Annotated[str, option("Publishes it; the authors belong to it.", "NAME")] = "",
    organisation_url: Annotated[str, option("Of its home page, or https://ror.org/...", "URL")] = "",
    as_json: AsJson = False,
) -> None:
    """Pack a folder of recordings as a Research Object Crate, described for a repository."""
    if as_json:
        leave_output_to_json()
    here = folder.resolve()
    # Not with_suffix: a folder may be called after a level, "0.5Vpp".
    crate = file_at(out, here.parent / f"{here.name}.zip")
    facts = CrateFacts(licence, tuple(author or ()), title, description, organisation, organisation_url)
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    found = verify_recordings(folder, key=seal_key())
    untrusted = {
        each.path: f"{each.verdict.replace('_', ' ')}: {each.sentence}" for each in found if each.is_bad
    }
    with transfer_bar("pack", size) as observer:
        packed = pack_folder(folder, crate, facts, untrusted, observer)
    console.print(f"packed {len(packed)} files into {crate}")
    unfinished = [each.path for each in found if each.verdict == SealState.UNFINISHED]
    if as_json:
        print_json(
            {"crate": str(crate), "files": len(packed), "unfinished": unfinished, "untrusted": untrusted}
        )
    for name in unfinished:
        errors.print(f"note: {name} is not finished and was left out; vibench recover finishes it")
    for name, why in untrusted.items():
        way = "the crate says so; restore it and pack again, or deposit the crate as it is"
        errors.print(f"error: {name} cannot be trusted ({why.rstrip('.')}): {way}")
    if untrusted:
        raise typer.Exit(ExitCode.FAILED)
