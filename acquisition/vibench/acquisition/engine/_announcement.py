"""Engines say where they can be asked, in a file that only their user can read."""

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

from pydantic import ValidationError

from ..host import FrozenModel, state_folder
from ._address import EngineAddress
from ._client import EngineClient
from ._errors import EngineError, EngineGone


class Announcement(FrozenModel):
    """An engine of this user on this computer."""

    pid: int
    what: str
    """What it was started for: a campaign's name, or ``"window"``."""
    started_utc: str
    address: EngineAddress


@contextmanager
def announced(address: EngineAddress, what: str) -> Iterator[None]:
    """Be found by `announced_engines` while inside."""
    told = Announcement(
        pid=os.getpid(),
        what=what,
        started_utc=datetime.now(UTC).isoformat(timespec="seconds"),
        address=address,
    )
    path = _folder() / f"{told.pid}.json"
    path.unlink(missing_ok=True)  # left by a process of the same number that was killed
    # Nobody else may read the token, not even for the moment before the mode is set.
    descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(descriptor, "w", encoding="utf-8") as file:
        json.dump(told.model_dump(), file)
    try:
        yield
    finally:
        path.unlink(missing_ok=True)


def announced_engines() -> tuple[Announcement, ...]:
    """Every engine that answers, oldest first; what killed ones have left is swept away."""
    found = []
    for path in sorted(_folder().glob("*.json")):
        try:
            told = Announcement.model_validate_json(path.read_text(encoding="utf-8"))
            EngineClient.attach(told.address).close()
        except (ValidationError, EngineGone):
            path.unlink(missing_ok=True)
            continue
        except (OSError, EngineError):  # ended in between, or the port belongs to another one now
            continue
        found.append(told)
    return tuple(sorted(found, key=lambda each: each.started_utc))


def the_engine(pid: int | None) -> Announcement:
    """Choose the engine that is meant: the one of that process, or the only one.

    Raises
    ------
    EngineError
        When there is none, or more than one and none was named.

    """
    engines = announced_engines()
    chosen = [each for each in engines if pid in (None, each.pid)]
    match chosen:
        case [one]:
            return one
        case []:
            wanted = "no engine is running" if pid is None else f"no engine runs as process {pid}"
            raise EngineError(f"{wanted}; 'vibench measure' and 'vibench gui' start one")
        case _:
            names = ", ".join(f"{each.pid} ({each.what})" for each in chosen)
            raise EngineError(f"several engines are running: {names}; name one with --pid")


def _folder() -> Path:
    folder = state_folder() / "engines"
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder
