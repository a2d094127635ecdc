"""Where answers are kept while a study runs: in memory alone, or in a file that survives a kill.

Order of a commit: cells -> sync -> states -> sync. Whatever moment the process or the power ends, a point
whose state says that it is done has all its cells. States, like everything else, are written once.
"""

from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Protocol, Self

import numpy as np

from . import _layout as layout
from ._arrays import Arrays, PointAnswer, empty_arrays, put
from ._columns import SESSION
from ._disk import Disk, SoleWriter
from ._errors import StudyError
from ._file_making import make_file
from ._file_reading import places_of, read_arrays, read_study
from ._software import software
from ._study import Study


class Store(Protocol):
    """Keeps answers. What it holds at first needs no computing."""

    @property
    def arrays(self) -> Arrays:
        """Everything kept so far; not to be written to."""

    def begin(self, executor: str) -> None:
        """Note that a session begins, and who computes in it."""

    def keep(self, answers: Sequence[PointAnswer]) -> None:
        """Keep answers; when it returns they are as safe as they will be."""


class MemoryStore:
    """Keeps answers as long as the process lives."""

    def __init__(self, study: Study) -> None:
        self._arrays = empty_arrays(study.grid)

    @property
    def arrays(self) -> Arrays:
        """Everything kept so far."""
        return self._arrays

    def begin(self, executor: str) -> None:
        """Nobody asks a memory when it began."""

    def keep(self, answers: Sequence[PointAnswer]) -> None:
        """Keep answers."""
        for answer in answers:
            for _ in put(self._arrays, answer):
                pass
            self._arrays[layout.STATE][answer.number] = answer.state


class FileStore:
    """Keeps answers in a study's file; a context that releases it.

    Raises
    ------
    StudyError
        When the file is another study's, is being written by another run, or is no study's file.

    """

    def __init__(self, path: Path, study: Study, opened: Callable[[Path], Disk] = SoleWriter) -> None:
        self._path = path
        self._disk = opened(path)
        try:
            _require_same(path, read_study(path), study)
            self._places = places_of(path)
            self._arrays = read_arrays(path)
        except BaseException:
            self._disk.close()
            raise
        self._session = 0

    @classmethod
    def created(cls, path: Path, study: Study) -> Self:
        """Create the file first; refuses a name that is taken."""
        make_file(path, study)
        return cls(path, study)

    @property
    def arrays(self) -> Arrays:
        """Everything kept so far."""
        return self._arrays

    def begin(self, executor: str) -> None:
        """Note moment, software and executor in the next row of sessions."""
        self._session = min(self._places.sessions, layout.MOST_SESSIONS - 1)
        texts = (datetime.now(UTC).isoformat(timespec="milliseconds"), software(), executor)
        for column, text in zip(layout.SESSION_COLUMNS, texts, strict=True):
            raw = text.encode()[: column.width].ljust(column.width, b"\0")
            self._write(self._places.session_columns[column.name] + self._session * column.width, raw)
        self._sync()
        counter = np.asarray(self._session + 1, dtype=layout.COUNTER_DTYPE)
        self._write(self._places.n_sessions, counter.tobytes())
        self._sync()

    def keep(self, answers: Sequence[PointAnswer]) -> None:
        """Commit answers in an order that cannot lie.

        Raises
        ------
        StudyError
            When the disk refuses; what was committed before is kept.

        """
        for answer in answers:
            cells = {**answer.cells, SESSION: self._session}
            for column, raw in put(self._arrays, PointAnswer(answer.number, answer.state, cells)):
                self._write(self._places.columns[column.name] + answer.number * len(raw), raw)
        self._sync()
        for answer in answers:
            self._write(self._places.columns[layout.STATE] + answer.number, bytes([answer.state]))
            self._arrays[layout.STATE][answer.number] = answer.state
        self._sync()

    def close(self) -> None:
        """Release the file."""
        self._disk.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _write(self, offset: int, raw: bytes) -> None:
        try:
            self._disk.write(offset, raw)
        except OSError as error:
            raise self._refused(error) from error

    def _sync(self) -> None:
        try:
            self._disk.sync()
        except OSError as error:
            raise self._refused(error) from error

    def _refused(self, error: OSError) -> StudyError:
        return StudyError(
            f"The disk refused {self._path}: {error.strerror}. What was kept before is safe;"
            " make room or mend the disk, and resume."
        )


def _require_same(path: Path, kept: Study, asked: Study) -> None:
    differing = asked.differences(kept)
    if differing:
        raise StudyError(
            f"{path} holds another study: {', '.join(_difference(name, kept, asked) for name in differing)}."
            " Nothing was changed; ask for the same study, or choose another file."
        )


SHOWN = 60
"""Characters of a value that a message shows."""


def _difference(name: str, kept: Study, asked: Study) -> str:
    """Say how one field of two studies differs; of long lists, where they begin to."""
    there, here = (study.model_dump(mode="json")[name] for study in (kept, asked))
    match there, here:
        case [*some], [*others]:
            index = next(
                (i for i, pair in enumerate(zip(some, others, strict=False)) if pair[0] != pair[1]),
                min(len(some), len(others)),
            )
            there, here = (_item(values, index) for values in (some, others))
        case _:
            pass
    return f"{name} is {_short(there)} there and {_short(here)} here"


def _item(values: list[object], index: int) -> str:
    if len(values) == 1:
        return str(values[0])
    return f"{values[index]} at place {index + 1}" if index < len(values) else f"{len(values)} values"


def _short(value: object) -> str:
    text = str(value)
    return text if len(text) <= SHOWN else text[:SHOWN] + "…"
