"""Starting an engine's process, and being the one whose end it follows."""

import subprocess
import sys
from contextlib import suppress
from threading import Event
from time import monotonic

from ..host.beside import ClosedOnLeaving
from ..host.chosen import chosen
from ._client import Announcement, EngineAddress, EngineClient, announced_engines
from ._status import ConnectionRole, Supervision
from ._wire import EngineGone

LEAVING_S = 10.0
"""How long an engine may take to ramp down, finish its recording and end [s]."""
LOOK_S = 0.02
"""How often the end of a process is looked for that is not a child of this one [s]."""


class AdoptedEngine(ClosedOnLeaving):
    """An engine that was left alone, taken over: from now on it ends with what it does, or when told to."""

    def __init__(self, announcement: Announcement) -> None:
        self._announcement = announcement
        self.address = announcement.address
        self.client = EngineClient.attach(announcement.address, ConnectionRole.ATTENDING)

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._announcement.pid

    def leave(self) -> None:
        """Let go of it; what was armed to be left alone goes on."""
        self.client.close()

    def close(self) -> None:
        """Let the engine ramp down and end, and wait for that. Legal at any time."""
        with suppress(EngineGone):
            self.client.shutdown()
        self.client.close()
        give_up_s, pause = monotonic() + LEAVING_S, Event()
        while self._announcement.is_alive and monotonic() < give_up_s:
            pause.wait(LOOK_S)


def left_alone() -> Announcement | None:
    """Find an engine that carries something out and was left alone by the program that started it."""
    for told in announced_engines():
        with suppress(EngineGone), EngineClient.attach(told.address) as client:
            if client.status().is_left_alone:
                return told
    return None


class EngineProcess(ClosedOnLeaving):
    """An engine's process and a connection to it. An attended engine ends with its starting program."""

    def __init__(self, process: "subprocess.Popen[str]", address: EngineAddress) -> None:
        self._process = process
        self.address = address
        """Where others may ask it as well."""
        self.client = EngineClient.attach(address, ConnectionRole.ATTENDING)

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    @property
    def is_alive(self) -> bool:
        """Whether it still runs."""
        return self._process.poll() is None

    def leave(self) -> None:
        """Let go of an engine that was armed to be left alone; it ends when it has done its work."""
        self.client.close()
        self._close_pipes()

    def close(self) -> None:
        """Let the engine ramp down and end, and wait for that. Legal at any time."""
        if self.is_alive:
            try:
                self.client.shutdown()
            except EngineGone:
                self._process.terminate()
        self.client.close()
        try:
            self._process.wait(LEAVING_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        # Not before: the end of its input tells an engine that it has been left alone.
        self._close_pipes()

    def _close_pipes(self) -> None:
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()


def start_engine(supervision: Supervision | str = Supervision.ATTENDED) -> EngineProcess:
    """Start an engine of this installation, with no bench open.

    Raises
    ------
    EngineGone
        When it does not start.

    """
    supervision = chosen(Supervision, supervision)
    process = subprocess.Popen(  # noqa: S603 - this interpreter, and nothing of a user's
        [sys.executable, "-m", "vibench.acquisition.engine", "--attendance", supervision.value],
        stdin=subprocess.PIPE if supervision is Supervision.ATTENDED else subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
        # The program that shows the run handles Ctrl-C, and decides what to ask of the engine.
        start_new_session=True,
    )
    assert process.stdout is not None
    line = process.stdout.readline()
    if not line:
        process.wait()
        raise EngineGone(
            f"the engine's process ended with code {process.returncode} before it could be asked; "
            "run 'python -m vibench.acquisition.engine' to see why"
        )
    return EngineProcess(process, EngineAddress.model_validate_json(line))
