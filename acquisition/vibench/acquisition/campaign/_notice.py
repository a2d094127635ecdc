"""Telling somebody who is not there of faults and of the end of a campaign: a command, or an e-mail."""

import json
import shlex
import shutil
import smtplib
import ssl
import subprocess  # the command is the user's own, given on the command line
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from email.message import EmailMessage
from enum import StrEnum
from pathlib import Path
from typing import Protocol

from pydantic import Field, PositiveFloat, PositiveInt, SecretStr

from ..errors import ConfigurationError
from ..host.toml_file import FrozenModel
from ._log import CampaignEvent, CampaignEventKind, CampaignListener


class Security(StrEnum):
    """How the way to the mail server is protected."""

    STARTTLS = "starttls"
    TLS = "tls"
    NONE = "none"
    """Plain text: only for a server on this computer."""


class MailSettings(FrozenModel):
    """Where mail goes, and through which server. Keep the file to yourself: it may hold a password."""

    host: str = Field(min_length=1)
    port: PositiveInt = 587
    security: Security = Security.STARTTLS
    sender: str = Field(pattern=r"^[^@\s]+@[^@\s]+$")
    recipients: tuple[str, ...] = Field(min_length=1)
    user: str = ""
    """Empty for a server that asks for none."""
    password: SecretStr = SecretStr("")
    timeout_s: PositiveFloat = Field(default=20.0, le=300)


class MailMessenger:
    """Sends each notice as a message."""

    def __init__(self, settings: MailSettings) -> None:
        self._settings = settings

    def send(self, notice: Mapping[str, str | int | float]) -> str:
        """Send one message; says in a clause how that went."""
        settings = self._settings
        try:
            with self._connected() as server:
                if settings.security is Security.STARTTLS:
                    server.starttls(context=ssl.create_default_context())
                if settings.user:
                    server.login(settings.user, settings.password.get_secret_value())
                server.send_message(self._message(notice))
        except (OSError, smtplib.SMTPException) as error:
            return f"mail through {settings.host} failed ({error})"
        return f"mail sent to {', '.join(settings.recipients)}"

    def _message(self, notice: Mapping[str, str | int | float]) -> EmailMessage:
        message = EmailMessage()
        message["Subject"] = f"vibench: {notice['campaign']}: {notice['event']}"
        message["From"] = self._settings.sender
        message["To"] = ", ".join(self._settings.recipients)
        message.set_content("\n".join(f"{key}: {value}" for key, value in notice.items()) + "\n")
        return message

    def _connected(self) -> smtplib.SMTP:
        settings = self._settings
        if settings.security is Security.TLS:
            context = ssl.create_default_context()
            return smtplib.SMTP_SSL(settings.host, settings.port, timeout=settings.timeout_s, context=context)
        return smtplib.SMTP(settings.host, settings.port, timeout=settings.timeout_s)


TOLD_OF = frozenset({CampaignEventKind.FAULT, CampaignEventKind.DAMAGED, CampaignEventKind.ENDED})
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
    """Follows a campaign, and passes faults and its end on. What fails there harms nothing."""

    def __init__(
        self, campaign: str, folder: Path, messengers: tuple[Messenger, ...], say: CampaignListener
    ) -> None:
        """``say``: told how each attempt to reach somebody went."""
        self._campaign = campaign
        self._folder = folder
        self._messengers = messengers
        self._say = say

    def __call__(self, event: CampaignEvent) -> None:
        """Pass an event on, if it is one to be told of."""
        if event.kind not in TOLD_OF:
            return
        notice = {
            "campaign": self._campaign,
            "folder": str(self._folder.resolve()),
            "utc": datetime.now(UTC).isoformat(timespec="seconds"),
            "event": event.kind.value,
            "reason": event.text,
            **event.facts,
        }
        for messenger in self._messengers:
            self._say(CampaignEvent(CampaignEventKind.NOTICE, messenger.send(notice)))
