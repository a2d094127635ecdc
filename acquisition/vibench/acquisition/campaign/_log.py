"""The log of a campaign: one JSON document a line, for programs and for the morning after."""

import json
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Self

from ..errors import RecordingError
from ._event import Happening

LOG_SUFFIX = ".log.jsonl"


class CampaignLog:
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

    def __call__(self, happening: Happening) -> None:
        """Write one happening down."""
        utc = datetime.now(UTC).isoformat(timespec="milliseconds")
        line = {"utc": utc, "event": happening.event.value, "text": happening.text, **happening.facts}
        with suppress(OSError):
            self._file.write(json.dumps(line) + "\n")
            self._file.flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with suppress(OSError):
            self._file.close()


def _ends_a_line(path: Path) -> bool:
    content = path.read_bytes()[-1:]
    return content in (b"", b"\n")
