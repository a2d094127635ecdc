"""Log of a campaign as JSON lines, status lines for ``tail -f``, and notices by command or mail."""

import json
import shlex
import shutil
import smtplib
import ssl
import subprocess  # runs only a command that the user has given
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from email.message import EmailMessage
from enum import StrEnum
from pathlib import Path
from time import monotonic
from typing import Any, Protocol

from pydantic import Field, PositiveFloat, PositiveInt, SecretStr

from ..errors import ConfigurationError, RecordingError
from ..host.beside import Beside, ClosedOnLeaving
from ..host.printable import printable
from ..host.toml_file import FrozenModel
from ..plan import measuring_s
from ._journal import CampaignProgress, JournalPoint, JournalPointState, ignore_result


class CampaignEventKind(StrEnum):
    """Kind of an event in a campaign."""

    BEGUN = "begun"
    RESUMED = "resumed"
    POINT_BEGUN = "point_begun"
    POINT_DONE = "point_done"
    POINT_STOPPED = "point_stopped"
    FAULT = "fault"
    """An attempt failed, or a fault ended the campaign."""
    DAMAGED = "damaged"
    """A complete recording is missing or differs from its seal (checksum); its point is measured again."""
    RETRY = "retry"
    RESTING = "resting"
    """Pause between two recordings."""
    MOVE_BEAM = "move_beam"
    """The operator must move the beam to the next point of a scan."""
    BENCH_REOPENED = "bench_reopened"
    FURTHER = "further"
    """Further measurements were requested after the result of a point."""
    ENDED = "ended"
    NOTICE = "notice"
    """A notice to a person was sent, or could not be sent."""


@dataclass(frozen=True)
class CampaignEvent:
    """One event, as a sentence and as named values."""

    kind: CampaignEventKind
    text: str
    facts: Mapping[str, str | int | float] = field(default_factory=dict)


CampaignListener = Callable[[CampaignEvent], None]
"""Function called with every event, in order; the function must not raise an exception."""
ignore_event: CampaignListener = ignore_result


LOG_SUFFIX = ".log.jsonl"


class CampaignLog(ClosedOnLeaving):
    """Writer of events to the log file; each line is flushed before the next step.

    If a line cannot be written (full disk), the campaign continues, because only its journal is essential.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._file = path.open("a", encoding="utf-8")
            # A killed program may have left an incomplete last line.
            if path.read_bytes()[-1:] not in (b"", b"\n"):
                self._file.write("\n")
        except OSError as error:
            raise RecordingError(
                f"{path} cannot be written ({error.strerror}). Nothing was played; give a folder that is "
                "writable"
            ) from error

    def __call__(self, event: CampaignEvent) -> None:
        utc = datetime.now(UTC).isoformat(timespec="milliseconds")
        line = {"utc": utc, "event": event.kind.value, "text": event.text, **event.facts}
        with suppress(OSError):
            self._file.write(json.dumps(line) + "\n")
            self._file.flush()

    def close(self) -> None:
        """Close the log. May be called at any time."""
        with suppress(OSError):
            self._file.close()


STATUS_SUFFIX = ".status"
LINE_EVERY_S = 5.0
"""Interval between status lines while a point is measured [s]; the lines take half a megabyte per night."""
LEFT_ALONE_S = 1.0
"""Longest wait at closing for the last lines to be written [s]."""


class StatusLine(ClosedOnLeaving):
    """Writer of a status line at every event, and every few seconds while a point is measured.

    Another thread writes the lines, so that an unresponsive network folder cannot delay a stop of the drive.
    """

    def __init__(
        self, path: Path, campaign: str, points: Sequence[JournalPoint], rest_s: float = 0.0
    ) -> None:
        """``rest_s`` is the pause between two points [s]."""
        self._path = path
        self._campaign = campaign
        self._counts = Counter(done=sum(point.state is JournalPointState.DONE for point in points))
        left_s = [
            measuring_s(each.measurement) for each in points if each.state is not JournalPointState.DONE
        ]
        self._left_s = sum(left_s) + rest_s * max(0, len(left_s) - 1)
        self._begun = monotonic()
        self._made_s = 0.0
        """Duration of all points and pauses before the running point, by the rig's clock [s]."""
        self._point_s = 0.0
        self._written = -LINE_EVERY_S
        self._where = ""
        self._beside = Beside("campaign status")

    def __call__(self, event: CampaignEvent) -> None:
        match event.kind:
            case CampaignEventKind.POINT_DONE:
                self._counts["done"] += 1
                self._made_s, self._point_s = self._made_s + self._point_s, 0.0
            case CampaignEventKind.RESTING:
                self._made_s += float(event.facts["rest_s"])
            case CampaignEventKind.FAULT if "point" in event.facts:
                self._counts["failed attempts"] += 1
        self._write(event.text)

    def progress(self, stand: CampaignProgress) -> None:
        """Update the progress after a block; write a line if the last line is older than `LINE_EVERY_S`."""
        run = stand.run
        self._point_s = run.elapsed_s
        self._where = f"{stand.number}/{stand.count} {stand.name}"
        if monotonic() - self._written >= LINE_EVERY_S:
            state = run.state.value.replace("_", " ")
            known = "" if run.until is None else f"; {run.until.sentence}"
            self._write(f"{state}, {run.elapsed_s:.0f} of {run.total_s:.0f} s{known}")

    def close(self) -> None:
        """Write the last status lines. May be called at any time."""
        self._beside.close(LEFT_ALONE_S)

    def _write(self, what: str) -> None:
        self._written = monotonic()
        counts = ", ".join(f"{number} {word}" for word, number in self._counts.items())
        utc = datetime.now(UTC).isoformat(timespec="seconds")
        # The remaining time is its planned value times this session's ratio of real to planned time.
        made_s = self._made_s + self._point_s
        pace = (monotonic() - self._begun) / made_s if made_s > 1.0 else 1.0
        left = timedelta(seconds=round(max(0.0, self._left_s - made_s) * pace))
        line = f"{utc} {self._campaign} {self._where}: {what} ({counts}, about {left} left)"
        self._beside.do(lambda: self._append(f"{printable(line)}\n"))

    def _append(self, line: str) -> None:
        # If a full disk prevents storing a status line, the measurement must still continue.
        with suppress(OSError), self._path.open("a", encoding="utf-8") as file:
            file.write(line)


class Security(StrEnum):
    """Encryption of the connection to the mail server."""

    STARTTLS = "starttls"
    TLS = "tls"
    NONE = "none"
    """The connection is not encrypted; allowed only for a server on this computer."""


class MailSettings(FrozenModel):
    """Mail server and recipients. Protect the file, because it may contain a password."""

    host: str = Field(min_length=1)
    port: PositiveInt = 587
    security: Security = Security.STARTTLS
    sender: str = Field(pattern=r"^[^@\s]+@[^@\s]+$")
    recipients: tuple[str, ...] = Field(min_length=1)
    user: str = ""
    """Login name for the mail server; empty for a server without login."""
    password: SecretStr = SecretStr("")
    timeout_s: PositiveFloat = Field(default=20.0, le=300)


class MailMessenger:
    """Messenger that sends each notice by mail."""

    def __init__(self, settings: MailSettings) -> None:
        self._settings = settings

    def send(self, notice: Mapping[str, str | int | float]) -> str:
        """Send one mail; return a clause that states whether it was sent."""
        settings = self._settings
        try:
            with self._connect() as server:
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
        message["Subject"] = printable(f"vibench: {notice['campaign']}: {notice['event']}")
        message["From"] = self._settings.sender
        message["To"] = ", ".join(self._settings.recipients)
        message.set_content("".join(f"{printable(f'{key}: {value}')}\n" for key, value in notice.items()))
        return message

    def _connect(self) -> smtplib.SMTP:
        settings = self._settings
        if settings.security is Security.TLS:
            context = ssl.create_default_context()
            return smtplib.SMTP_SSL(settings.host, settings.port, timeout=settings.timeout_s, context=context)
        return smtplib.SMTP(settings.host, settings.port, timeout=settings.timeout_s)


TOLD_OF = frozenset({CampaignEventKind.FAULT, CampaignEventKind.DAMAGED, CampaignEventKind.ENDED})
COMMAND_LONGEST_S = 30.0
"""Time after which a command that sends a notice is terminated [s]."""


class Messenger(Protocol):
    """A way to send notices to a person."""

    def send(self, notice: Mapping[str, str | int | float]) -> str:
        """Send a notice; return a clause that states whether it was sent. Never raise an exception."""


@dataclass(frozen=True)
class CommandMessenger:
    """Messenger that runs a command without a shell; the command reads the notice as JSON from stdin."""

    arguments: tuple[str, ...]

    @classmethod
    def of(cls, command: str) -> "CommandMessenger":
        """Return the messenger for a command line with shell quoting, but no variables, wildcards or pipes.

        Raises ConfigurationError if the line is empty, a quotation is not closed, or no such program exists.
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
                f"the program {arguments[0]!r} was not found, or is not executable; give its path"
            )
        return cls(arguments)

    def send(self, notice: Mapping[str, str | int | float]) -> str:
        """Run the command, and end it after `COMMAND_LONGEST_S`. Return a clause that states the result."""
        return self.run(notice, COMMAND_LONGEST_S) or f"{self.arguments[0]} ended with 0"

    def run(self, document: Mapping[str, Any], longest_s: float) -> str:
        """Run the command with ``document`` as input; return a clause about its failure, or an empty text."""
        try:
            ended = subprocess.run(  # noqa: S603 - given by the user, and run without a shell
                self.arguments,
                input=json.dumps(document).encode(),
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=longest_s,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return f"{self.arguments[0]} took more than {longest_s:g} s and was stopped"
        except OSError as error:
            return f"{self.arguments[0]} could not be run ({error.strerror})"
        return f"{self.arguments[0]} ended with {ended.returncode}" if ended.returncode else ""


@dataclass(frozen=True)
class Notifier:
    """Sender of notices of faults, damaged recordings and the campaign's end; failures to send are logged."""

    campaign: str
    folder: Path
    messengers: tuple[Messenger, ...]
    say: CampaignListener
    """Function called for each notice, with a clause that states whether the notice was sent."""

    def __call__(self, event: CampaignEvent) -> None:
        if event.kind not in TOLD_OF:
            return
        notice = {
            "campaign": self.campaign,
            "folder": str(self.folder.resolve()),
            "utc": datetime.now(UTC).isoformat(timespec="seconds"),
            "event": event.kind.value,
            "reason": event.text,
            **event.facts,
        }
        for messenger in self.messengers:
            self.say(CampaignEvent(CampaignEventKind.NOTICE, messenger.send(notice)))
