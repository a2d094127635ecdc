"""Telling somebody who is not there: at the end of a campaign, and at every fault."""

import json
import shlex
import shutil
import subprocess  # the command is the user's own, given on the command line
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Protocol

from ..errors import ConfigurationError
from ._event import Event, Happening, Listener

TOLD_OF = frozenset({Event.FAULT, Event.ENDED})
COMMAND_LONGEST_S = 30.0
"""A command that takes longer is ended [s]."""


class Messenger(Protocol):
    """A way to reach somebody."""

    def send(self, notice: Mapping[str, str | int | float]) -> str:
        """Pass a notice on; says in a clause how that went, and never raises."""


@dataclass(frozen=True)
class CommandMessenger:
    """Runs a command with the notice as JSON on its standard input; no shell has a say in it."""

    arguments: tuple[str, ...]

    @classmethod
    def of(cls, command: str) -> "CommandMessenger":
        """Take a command line apart, as a shell would, but for variables, wildcards and pipes.

        Raises
        ------
        ConfigurationError
            When it is empty, a quotation mark is missing, or there is no such program.

        """
        try:
            arguments = tuple(shlex.split(command))
        except ValueError as error:
            raise ConfigurationError(
                f"the command {command!r} cannot be read ({error}); close every quotation mark"
            ) from error
        if not arguments:
            raise ConfigurationError("the command is empty; give a program and its arguments")
        if shutil.which(arguments[0]) is None:
            raise ConfigurationError(
                f"the command {arguments[0]!r} is no program that can be run here; give the path of one"
            )
        return cls(arguments)

    def send(self, notice: Mapping[str, str | int | float]) -> str:
        """Run the command and wait for its end, or end it."""
        try:
            ended = subprocess.run(  # noqa: S603 - given by the user, and run without a shell
                self.arguments,
                input=json.dumps(notice).encode(),
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=COMMAND_LONGEST_S,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return f"{self.arguments[0]} took more than {COMMAND_LONGEST_S:g} s and was ended"
        except OSError as error:
            return f"{self.arguments[0]} could not be run ({error.strerror})"
        return f"{self.arguments[0]} ended with {ended.returncode}"


class Notifier:
    """Listens to a campaign, and passes faults and its end on. What fails there harms nothing."""

    def __init__(self, campaign: str, folder: Path, messengers: tuple[Messenger, ...], say: Listener) -> None:
        """``say``: told how each attempt to reach somebody went."""
        self._campaign = campaign
        self._folder = folder
        self._messengers = messengers
        self._say = say

    def __call__(self, happening: Happening) -> None:
        """Pass a happening on, if it is one to be told of."""
        if happening.event not in TOLD_OF:
            return
        notice = {
            "campaign": self._campaign,
            "folder": str(self._folder.resolve()),
            "utc": datetime.now(UTC).isoformat(timespec="seconds"),
            "event": happening.event.value,
            "reason": happening.text,
            **happening.facts,
        }
        for messenger in self._messengers:
            self._say(Happening(Event.NOTICE, messenger.send(notice)))
