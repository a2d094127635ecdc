"""Options that say who is told of faults and of the end of a campaign."""

from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition import load_toml
from vibench.acquisition.campaign import CommandMessenger, MailMessenger, MailSettings, Messenger

NotifyCommand = Annotated[
    str | None,
    typer.Option(
        "--notify",
        metavar="COMMAND",
        help="Run at every fault and at the end, the reason as JSON on its standard input; no shell.",
    ),
]
MailPath = Annotated[
    Path | None, typer.Option("--mail", metavar="MAIL.toml", help="Send mail at every fault and at the end.")
]


def messengers_of(notify: str | None, mail: Path | None) -> tuple[Messenger, ...]:
    """Give the ways to reach somebody that were asked for; raises ConfigurationError."""
    found: list[Messenger] = []
    if notify is not None:
        found.append(CommandMessenger.of(notify))
    if mail is not None:
        found.append(MailMessenger(load_toml(mail.expanduser(), MailSettings)))
    return tuple(found)
