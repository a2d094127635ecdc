"""`vibench verify`: check recordings against their seals (checksums)."""

from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition.campaign import verify_recordings
from vibench.acquisition.recording import SealDepth, seal_key

from .options import option
from .output import ExitCode, console, errors, print_json
from .paths import AllowExternal, AsJson


def verify(
    place: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder of recordings, or one recording, NAME.h5.")
    ],
    quick: Annotated[bool, option("Check attributes, texts and tables only, not every sample.")] = False,
    key: Annotated[
        Path | None,
        option("Key file of the signatures; by default the file named by VIBENCH_SEAL_KEY.", "FILE"),
    ] = None,
    _allow_external: AllowExternal = False,
    as_json: AsJson = False,
) -> None:
    """Check the seals of all recordings and journals in a folder, including every sample."""
    found = verify_recordings(place, SealDepth.QUICK if quick else SealDepth.WHOLE, seal_key(key))
    counts = Counter(each.verdict for each in found)
    if as_json:
        print_json(
            {
                "place": str(place.resolve()),
                "depth": "quick" if quick else "whole",
                "counts": dict(counts),
                "recordings": [asdict(each) | {"is_bad": each.is_bad} for each in found],
            }
        )
    else:
        for each in found:
            console.print(f"{each.verdict:10}  {each.path}: {each.sentence}")
        summary = [f"{count} {verdict}" for verdict, count in counts.items()] or ["no recordings"]
        console.print(", ".join([*summary, "samples not checked"] if quick else summary))
    bad = [each for each in found if each.is_bad]
    if bad:
        named = ", ".join(each.path for each in bad)
        errors.print(f"error: {len(bad)} of {len(found)} recordings cannot be trusted: {named}")
        raise typer.Exit(ExitCode.FAILED)
