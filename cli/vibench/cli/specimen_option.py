"""Which specimen a command is about, and what of it is replaced: options that several commands share."""

from typing import Annotated

import typer

from vibench.analysis import InvalidRequest
from vibench.sim import (
    CONTACT_LAWS,
    SpecimenTable,
    UnknownSpecimenError,
    load_specimen,
    shipped_specimens,
    usual_specimen,
)

SPECIMENS_HELP = "A specimen's file, or one of these: " + "; ".join(
    f"{name} ({each.about})" for name, each in shipped_specimens().items()
)
LAWS_HELP = "Contact law instead of the specimen's own: " + "; ".join(
    f"{law.form} ({law.about})" for law in CONTACT_LAWS.values()
)
SpecimenOption = Annotated[
    str | None, typer.Option("--specimen", metavar="NAME|FILE.toml", help=SPECIMENS_HELP)
]


def described(specimen: str | None) -> SpecimenTable:
    """Read the specimen that an option names, the paper's where it names none.

    Raises
    ------
    InvalidRequest
        When there is none, or when the file does not describe one.

    """
    if specimen is None:
        return usual_specimen()
    try:
        return SpecimenTable.model_validate(load_specimen(specimen).model_dump())
    except UnknownSpecimenError as error:
        raise InvalidRequest(str(error)) from error


def given_options(**options: object) -> dict[str, object]:
    """Keep what was typed, each as an axis of one value; what was not is left to the specimen."""
    return {name: (value,) for name, value in options.items() if value is not None}
