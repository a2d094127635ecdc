"""`vibench schema`: the JSON Schema of a TOML file, for editors and other programs."""

from typing import Annotated

import typer

from vibench.acquisition import json_schema

from .output import print_json


def schema(
    kind: Annotated[
        str, typer.Argument(metavar="KIND", help="Kind: campaign, rig, study, map, mapping or specimen.")
    ],
) -> None:
    """Print the JSON Schema (draft 4) of one kind of TOML file; editors use schemas to check files."""
    print_json(json_schema(kind))
