"""Messages to the user: what happened, what was done about it, what to do next."""

from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum

from vibench.acquisition import printable


class NoticeKind(StrEnum):
    """Severity of a message."""

    INFO = "info"
    WARNING = "warning"
    FAULT = "fault"


@dataclass(frozen=True)
class Notice:
    """Message to the user; empty parts are not shown."""

    kind: NoticeKind
    what: str
    """What happened, as a sentence."""
    done: str = ""
    """What the program did about it."""
    next_step: str = ""
    """Advice to the user on what to do next."""
    code: str = ""
    """Name of the error class, for which the user can search in the documentation."""
    details: str = ""

    @property
    def text(self) -> str:
        """The whole message as text, for the clipboard and for a log."""
        code = f"[{self.code}] " if self.code else ""
        parts = (f"{self.kind.value.upper()}: {code}{self.what}", self.done, self.next_step, self.details)
        return "\n".join(part for part in parts if part)


def notice_of(error: BaseException, next_step: str = "") -> Notice:
    """Return an error as a notice; the error's message already contains all parts of the notice."""
    return Notice(
        NoticeKind.FAULT,
        printable(str(error)) or type(error).__name__,
        next_step=next_step,
        code=type(error).__name__,
        details="\n".join(getattr(error, "__notes__", ())),
    )


def clock(seconds: float) -> str:
    """Return a duration in minutes and seconds, with hours if needed: ``"3:20"``."""
    whole = max(0, round(seconds))
    hours, minutes = whole // 3600, whole // 60 % 60
    return f"{hours}:{minutes:02}:{whole % 60:02}" if hours else f"{minutes}:{whole % 60:02}"


def moment_text(utc: str) -> str:
    """Return the start of a recording in local time: ``"2026-03-01 13:00:05"``."""
    try:
        return datetime.fromisoformat(utc).astimezone().strftime("%Y-%m-%d %H:%M:%S")
    except ValueError:
        return utc


def outcome_text(state: str, reason: str) -> str:
    """Return state and reason as one text: ``"stopped by the operator"``, ``"failed: no laser signal"``."""
    return reason if reason.startswith(state) else f"{state}: {reason}" if reason else state


RIG = "Rig"
TEST = "Test"
RUN = "Run"
FILES = "Files"
COMPARE = "Compare"
SIMULATE = "Simulate"
MAPS = "Maps"
QUEUE = "Queue"
