"""Engines say where they can be asked, in a file that only their user can read."""

import os
import platform
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path

from pydantic import ValidationError

from vibench.sim.operating_system import is_process, process_start

from ..host import FrozenModel
from ._address import EngineAddress
from ._errors import EngineError
from ._kept_stops import engines_folder

REFUSAL_S = 0.2
"""How long a refusal is waited for; one on this computer comes at once [s]."""


class Announcement(FrozenModel):
    """An engine of this user on this computer."""

    pid: int
    what: str
    """What it was started for: a campaign's name, or ``"window"``."""
    started_utc: str
    address: EngineAddress
    process_start: str = ""
    """When its process began, as the system counts: a number is given again, this pair is not."""
    computer: str = ""
    """A state folder may lie in a home that several computers share."""

    @property
    def is_alive(self) -> bool:
        """Whether its process lives, answering or not."""
        return is_process(self.pid, self.process_start)


@contextmanager
def announced(address: EngineAddress, what: str) -> Iterator[None]:
    """Be found by `announced_engines` while inside; raises EngineError when that cannot be."""
    pid = os.getpid()
    told = Announcement(
        pid=pid,
        what=what,
        started_utc=datetime.now(UTC).isoformat(timespec="seconds"),
        address=address,
        process_start=process_start(pid) or "",
        computer=platform.node(),
    )
    path: Path | None = None
    try:
        path = _written(told)
        yield
    finally:
        if path is not None:
            with suppress(OSError):
                path.unlink()


def _written(told: Announcement) -> Path:
    try:
        path = engines_folder() / f"{told.pid}.json"
        coming = path.with_suffix(".coming")
        coming.unlink(missing_ok=True)  # left by a process of the same number that was killed
        # Nobody else may read the token, not even for the moment before the mode is set.
        descriptor = os.open(coming, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            file.write(told.model_dump_json())
        return coming.replace(path)  # whole, or not there
    except OSError as error:
        raise EngineError(
            f"the engine cannot be announced in the state folder ({error}), so that nobody could stop it. "
            "Nothing was started; make room there, or name another folder with VIBENCH_STATE_DIR"
        ) from error


def announced_engines() -> tuple[Announcement, ...]:
    """Every engine of this computer whose process lives, oldest first, whether it answers or not.

    What is left of processes that have ended is swept away; nothing else is.
    """
    found = []
    for path in sorted(engines_folder().glob("*.json")):
        try:
            told = Announcement.model_validate_json(path.read_text(encoding="utf-8"))
        except (ValidationError, OSError):  # another version's, or ended in between
            continue
        if told.computer not in ("", platform.node()):
            continue
        if not told.is_alive or _refuses(told.address):
            path.unlink(missing_ok=True)
            continue
        found.append(told)
    _sweep()
    return tuple(sorted(found, key=lambda each: each.started_utc))


def the_engine(pid: int | None) -> Announcement:
    """Choose the engine that is meant: the one of that process, or the only one.

    Parameters
    ----------
    pid
        Number of its process; None: the only one.

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


def _refuses(address: EngineAddress) -> bool:
    """Whether nobody listens there any more: to be slow, or too busy to answer, is no refusal."""
    try:
        socket.create_connection((address.host, address.port), REFUSAL_S).close()
    except ConnectionRefusedError:
        return True
    except OSError:
        return False
    return False


def _sweep() -> None:
    """Take away what was put down for processes that have ended; names begin with the process's number."""
    folder = engines_folder()
    for path in folder.iterdir():
        pid, _, rest = path.name.partition(".")
        start = rest.partition(".")[0] if ".stop-" in rest else ""
        is_announced = (folder / f"{pid}.json").exists()  # perhaps of another computer
        if not is_announced and pid.isdigit() and not is_process(int(pid), start):
            path.unlink(missing_ok=True)
