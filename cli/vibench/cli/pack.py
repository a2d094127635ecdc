"""`vibench pack`: pack a campaign's folder into a zip file with a description, for a repository."""

from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition.campaign import verify_recordings
from vibench.acquisition.recording import SealState, seal_key
from vibench.analysis.exchange import CrateFacts, pack_folder
from vibench.sim import count_text

from .options import option
from .output import ExitCode, console, errors, leave_output_to_json, print_json
from .paths import AsJson, file_at
from .progress_bars import transfer_bar


def pack(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder with recordings and other files.")],
    licence: Annotated[
        str, option("Licence, such as https://creativecommons.org/licenses/by/4.0/.", "URL", name="--license")
    ],
    out: Annotated[
        Path | None, option("Path of the new file or its folder; by default DIR.zip beside DIR.", "CRATE.zip")
    ] = None,
    author: Annotated[list[str] | None, option("Author; may be repeated.", "NAME")] = None,
    title: Annotated[str, option("Title of the package; by default the name of the folder.")] = "",
    description: Annotated[str, option("Description of the data in one or two sentences.")] = "",
    organisation: Annotated[str, option("Publisher, and the authors' affiliation.", "NAME")] = "",
    organisation_url: Annotated[str, option("Publisher's home page, or https://ror.org/...", "URL")] = "",
    as_json: AsJson = False,
) -> None:
    """Pack a folder of recordings as a Research Object Crate for a data repository."""
    if as_json:
        leave_output_to_json()
    here = folder.resolve()
    # Not with_suffix: the name of a folder may contain a dot, such as "0.5Vpp".
    crate = file_at(out, here.parent / f"{here.name}.zip")
    facts = CrateFacts(licence, tuple(author or ()), title, description, organisation, organisation_url)
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    found = verify_recordings(folder, key=seal_key())
    untrusted = {
        each.path: f"{each.verdict.replace('_', ' ')}: {each.sentence}" for each in found if each.is_bad
    }
    with transfer_bar("pack", size) as observer:
        packed = pack_folder(folder, crate, facts, untrusted, observer)
    console.print(f"packed {count_text(len(packed), 'file')} into {crate}")
    unfinished = [each.path for each in found if each.verdict == SealState.UNFINISHED]
    if as_json:
        print_json(
            {"crate": str(crate), "files": len(packed), "unfinished": unfinished, "untrusted": untrusted}
        )
    for name in unfinished:
        errors.print(f"note: {name} is not finished and was omitted; vibench recover finishes it")
    for name, why in untrusted.items():
        way = "the crate states this; restore the file and pack again, or deposit the crate as it is"
        errors.print(f"error: {name} cannot be trusted ({why.rstrip('.')}): {way}")
    if untrusted:
        raise typer.Exit(ExitCode.FAILED)
