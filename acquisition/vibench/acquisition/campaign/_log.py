"""The log of a campaign, one JSON document a line, and its status in one line for ``tail -f``."""

import json
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from pathlib import Path
from time import monotonic

from ..errors import RecordingError
from ..host.beside import Beside, ClosedOnLeaving
from ..plan import measured_s
from ._journal import CampaignProgress, JournalPoint, JournalPointState


class CampaignEventKind(StrEnum):
    """What happened."""

    BEGUN = "begun"
    RESUMED = "resumed"
    POINT_BEGUN = "point_begun"
    POINT_DONE = "point_done"
    POINT_STOPPED = "point_stopped"
    FAULT = "fault"
    """An attempt failed, or the campaign met something that ends it."""
    DAMAGED = "damaged"
    """A recording that was complete is not as it was sealed, or is gone; its point is made again."""
    RETRY = "retry"
    RESTING = "resting"
    """Silence between two recordings."""
    BENCH_REOPENED = "bench_reopened"
    FURTHER = "further"
    """A result asked for more measurements."""
    ENDED = "ended"
    NOTICE = "notice"
    """Somebody was told, or could not be reached."""


@dataclass(frozen=True)
class CampaignEvent:
    """One thing that happened, as a sentence and as facts."""

    kind: CampaignEventKind
    text: str
    facts: Mapping[str, str | int | float] = field(default_factory=dict)


CampaignListener = Callable[[CampaignEvent], None]
"""Told of every event, in order; must not raise."""


def ignore_event(event: CampaignEvent) -> None:
    """Tell nobody."""


LOG_SUFFIX = ".log.jsonl"


class CampaignLog(ClosedOnLeaving):
    """Appends what happens; a line is on its way to the disk before the next thing is done.

    A log that cannot be written (the disk is full) is no reason to stop: the journal is what counts.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._file = path.open("a", encoding="utf-8")
            # A program that was killed may have left half a line.
            if not _ends_a_line(path):
                self._file.write("\n")
        except OSError as error:
            raise RecordingError(
                f"{path} cannot be written ({error.strerror}). Nothing was played; give a folder that may be "
                "written"
            ) from error

    def __call__(self, event: CampaignEvent) -> None:
        """Write one event down."""
        utc = datetime.now(UTC).isoformat(timespec="milliseconds")
        line = {"utc": utc, "event": event.kind.value, "text": event.text, **event.facts}
        with suppress(OSError):
            self._file.write(json.dumps(line) + "\n")
            self._file.flush()

    def close(self) -> None:
        """End the log. Legal at any time."""
        with suppress(OSError):
            self._file.close()


def _ends_a_line(path: Path) -> bool:
    content = path.read_bytes()[-1:]
    return content in (b"", b"\n")


STATUS_SUFFIX = ".status"
LINE_EVERY_S = 5.0
"""While nothing else happens [s]: a night makes half a megabyte."""
LEFT_ALONE_S = 1.0
"""How long the last lines may take [s]."""


class StatusLine(ClosedOnLeaving):
    """Appends a line whenever something happens, and every few seconds while a point runs.

    Whoever plays does not wait for it: a folder that hangs would leave the drive on.
    """

    def __init__(
        self, path: Path, campaign: str, points: Sequence[JournalPoint], rest_s: float = 0.0
    ) -> None:
        """``rest_s`` lies between two points."""
        self._path = path
        self._campaign = campaign
        self._counts = Counter(done=sum(point.state is JournalPointState.DONE for point in points))
        left_s = [measured_s(each.measurement) for each in points if each.state is not JournalPointState.DONE]
        self._left_s = sum(left_s) + rest_s * max(0, len(left_s) - 1)
        self._begun = monotonic()
        self._made_s = 0.0
        """Rig time behind the point that runs."""
        self._point_s = 0.0
        self._written = -LINE_EVERY_S
        self._where = ""
        self._beside = Beside("campaign status")

    def __call__(self, event: CampaignEvent) -> None:
        """Write what has happened."""
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
        """Note a block; write a line when the last one is old."""
        run = stand.run
        self._point_s = run.elapsed_s
        self._where = f"{stand.number}/{stand.count} {stand.name}"
        if monotonic() - self._written >= LINE_EVERY_S:
            state = run.state.value.replace("_", " ")
            self._write(f"{state}, {run.elapsed_s:.0f} of {run.total_s:.0f} s")

    def close(self) -> None:
        """Let the last lines be written. Legal at any time."""
        self._beside.close(LEFT_ALONE_S)

    def _write(self, what: str) -> None:
        self._written = monotonic()
        counts = ", ".join(f"{number} {word}" for word, number in self._counts.items())
        utc = datetime.now(UTC).isoformat(timespec="seconds")
        line = f"{utc} {self._campaign} {self._where}: {what} ({counts}, about {self._left()} left)\n"
        self._beside.do(lambda: self._append(line))

    def _append(self, line: str) -> None:
        # A full disk must not end a measurement for the sake of this line.
        with suppress(OSError), self._path.open("a", encoding="utf-8") as file:
            file.write(line)

    def _left(self) -> timedelta:
        """Time left, at the pace of this session; before there is one, at the rig's own."""
        made_s = self._made_s + self._point_s
        pace = (monotonic() - self._begun) / made_s if made_s > 1.0 else 1.0
        return timedelta(seconds=round(max(0.0, self._left_s - made_s) * pace))
