"""What has happened, kept for viewers: the newest messages, numbered."""

from collections import deque
from datetime import UTC, datetime

from ..errors import AcquisitionError
from ._status import EngineMessage, MessageKind

KEPT = 100


class Messages:
    """The newest messages of an engine."""

    def __init__(self) -> None:
        self._kept: deque[EngineMessage] = deque(maxlen=KEPT)
        self._count = 0

    @property
    def kept(self) -> tuple[EngineMessage, ...]:
        """The newest, oldest first."""
        return tuple(self._kept)

    def info(self, what: str) -> None:
        """Note something that needs no answer."""
        self._add(MessageKind.INFO, what, "", "", "")

    def warn(self, what: str, done: str = "", next_step: str = "") -> None:
        """Note something to be looked at."""
        self._add(MessageKind.WARNING, what, done, next_step, "")

    def fault(self, error: BaseException) -> None:
        """Note an error; ours say in this order what happened, what was done, and what to do next."""
        match error:
            case AcquisitionError():
                what, done, next_step = told_apart(str(error))
            case _:
                what = f"{type(error).__name__}: {error}"
                done, next_step = "The drive was silenced.", "This is a fault of the program: report it."
        self._add(MessageKind.FAULT, what, done, next_step, type(error).__name__)

    def _add(self, kind: MessageKind, what: str, done: str, next_step: str, code: str) -> None:
        self._count += 1
        utc = datetime.now(UTC).isoformat(timespec="seconds")
        self._kept.append(
            EngineMessage(
                number=self._count, utc=utc, kind=kind, what=what, done=done, next_step=next_step, code=code
            )
        )


def told_apart(text: str) -> tuple[str, str, str]:
    """Split "What happened. What was done; what to do next" into its parts; missing ones are empty."""
    what, _, rest = text.partition(". ")
    done, _, next_step = rest.partition("; ")
    return (f"{what.rstrip('.')}.", _sentence(done), _sentence(next_step))


def _sentence(clause: str) -> str:
    clause = clause.strip().rstrip(".")
    return f"{clause[0].upper()}{clause[1:]}." if clause else ""
