"""Functions and classes that start, take over or stop an engine's process."""

import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from enum import StrEnum
from pathlib import Path
from threading import Event
from time import monotonic

from vibench.stop_files import HEEDED_S, SWITCH_OFF, Fate, fate_of, stop_path, write_stop_file

from ..host.beside import ClosedOnLeaving
from ..host.toml_file import member
from ..stopping.program import Program, engines_folder
from ..stopping.stop import StopLevel
from ._client import Announcement, EngineAddress, EngineClient, announced_engines
from ._status import SOUNDING, ConnectionRole, EngineState, Supervision
from ._wire import EngineError, EngineGone, EngineSilent

LEAVING_S = 10.0
"""Time limit for an engine to ramp down, finish its recording and end [s]."""
LOOK_S = 0.02
"""Interval at which to check whether a process that is not a child has ended [s]."""


class AdoptedEngine(ClosedOnLeaving):
    """Engine taken over from a parent program that has ended; it ends with the campaign, or on request."""

    def __init__(self, announcement: Announcement) -> None:
        self._announcement = announcement
        self.pid = announcement.pid
        """Number of the engine's process."""
        self.address = announcement.address
        self.client = EngineClient.attach(announcement.address, ConnectionRole.ATTENDING)

    def leave(self) -> None:
        """Stop attending the engine; an unattended campaign continues."""
        self.client.close()

    def close(self) -> None:
        """Let the engine ramp down and end, and wait until it has ended. May be called at any time."""
        with suppress(EngineGone):
            self.client.shutdown()
        self.client.close()
        _until(lambda: not self._announcement.is_alive, LEAVING_S)


def unattended_engine() -> Announcement | None:
    """Return an engine that runs a campaign although its parent program has ended, or None."""
    for announcement in announced_engines():
        with suppress(EngineGone), EngineClient.attach(announcement.address) as client:
            if client.status().is_left_alone:
                return announcement
    return None


class EngineProcess(ClosedOnLeaving):
    """An engine's process and a connection to it. An attended engine ends with its parent program."""

    def __init__(self, process: "subprocess.Popen[str]", address: EngineAddress) -> None:
        self._process = process
        self.pid = process.pid
        """Number of the engine's process."""
        self.address = address
        """Address of the engine for other programs."""
        self.client = EngineClient.attach(address, ConnectionRole.ATTENDING)

    @property
    def is_alive(self) -> bool:
        """Whether the engine's process still runs."""
        return self._process.poll() is None

    def leave(self) -> None:
        """Stop attending the engine; if its campaign is unattended, the engine ends after the campaign."""
        self.client.close()
        self._close_pipes()

    def close(self) -> None:
        """Let the engine ramp down and end, and wait until it has ended. May be called at any time."""
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
        # Close the pipes last: when its input ends, an engine assumes that its parent process has ended.
        self._close_pipes()

    def _close_pipes(self) -> None:
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                pipe.close()


def start_engine(supervision: Supervision | str = Supervision.ATTENDED) -> EngineProcess:
    """Start an engine of this installation, with no bench open. Raises EngineGone when it does not start."""
    supervision = member(Supervision, supervision)
    process = subprocess.Popen(  # noqa: S603 - this interpreter, and nothing of a user's
        [sys.executable, "-m", "vibench.acquisition.engine", "--attendance", supervision.value],
        stdin=subprocess.PIPE if supervision is Supervision.ATTENDED else subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
        # The program that shows the run handles Ctrl-C.
        start_new_session=True,
    )
    assert process.stdout is not None
    line = process.stdout.readline()
    if not line:
        process.wait()
        raise EngineGone(
            f"the engine's process ended with code {process.returncode} before it answered; "
            "run 'python -m vibench.acquisition.engine' to see why"
        )
    return EngineProcess(process, EngineAddress.model_validate_json(line))


PATIENCE_S = 1.0
"""Longest wait for an answer from the engine, which usually answers within milliseconds [s]."""


class StopDelivery(StrEnum):
    """Result of sending a stop to a program."""

    TOLD = "told"
    """An engine accepted the stop, and its output was read back as off."""
    TAKEN = "taken"
    """A program that is not an engine accepted the stop, and its output was read back as off."""
    UNHEEDED = "unheeded"
    """The engine accepted the stop but has not confirmed that its output is off."""
    KEPT = "kept"
    """The engine has not accepted the stop; its process exists and will obey when it runs again."""


def stop_engine(
    engine: Program, level: StopLevel | str = StopLevel.RAMP, reason: str = "stopped by the operator"
) -> StopDelivery:
    """Stop the drive of an engine or another program, and its campaign.

    The stop is written to a file in the state folder. The program obeys within 0.05 s, or when its process
    runs again. The function returns when the program has confirmed that its output is off, or after a time
    limit. If no file can be written, or the program does not read it, the stop is sent over the engine's
    connection. A hold (pause) is never written to a file, because it may then begin late. ``engine`` is
    the announcement of the program, ``level`` is the kind of stop, and ``reason`` is stored in the recording.

    Raises
    ------
    EngineGone
        When the process has ended, or the stop could neither be sent nor written.
    EngineError
        When a hold is requested from a program that is not an engine.
    """
    level = member(StopLevel, level)
    ended = EngineGone(
        f"process {engine.pid} ({engine.what}) ended without confirming that its output is off. {SWITCH_OFF}"
    )
    if not _runs(engine):
        raise ended
    reason = reason.encode(errors="replace").decode()  # text from a terminal may contain surrogates
    if level is StopLevel.HOLD:
        if not isinstance(engine, Announcement):
            raise EngineError(
                f"process {engine.pid} ({engine.what}) is not an engine and cannot be held. That process "
                "continues; stop it with ramp, abort or off"
            )
        _send_stop(engine, level, reason)
        return StopDelivery.TOLD
    stop = stop_path(str(engines_folder()), engine.pid, engine.process_start, level)
    try:
        write_stop_file(stop, reason)
    except OSError as error:
        if isinstance(engine, Announcement):
            return _send_stop(engine, level, reason)
        raise EngineGone(
            f"the stop for process {engine.pid} was not written to the state folder: {error}. {SWITCH_OFF}"
        ) from error
    match fate_of(stop, lambda: _runs(engine)):
        case Fate.SILENT:
            return StopDelivery.TOLD if isinstance(engine, Announcement) else StopDelivery.TAKEN
        case Fate.UNCONFIRMED if _runs(engine):
            return StopDelivery.UNHEEDED
        case Fate.NOT_TAKEN if _runs(engine):
            if isinstance(engine, Announcement):
                with suppress(EngineError):  # the engine does not respond; the stop remains in the folder
                    return _send_stop(engine, level, reason)
            return StopDelivery.KEPT
    with suppress(OSError):
        Path(stop).unlink()
    raise ended


def _runs(engine: Program) -> bool:
    """Whether the process runs at the time of the call; the process may end during a stop."""
    return engine.is_alive


def _send_stop(engine: Announcement, level: StopLevel, reason: str) -> StopDelivery:
    with EngineClient.attach(engine.address, patience_s=PATIENCE_S) as client:
        client.stop(level, reason)
        try:
            if level is StopLevel.HOLD or _until(lambda: _has_obeyed(client), HEEDED_S):
                return StopDelivery.TOLD
        except EngineSilent:
            return StopDelivery.UNHEEDED
    return StopDelivery.UNHEEDED


def _has_obeyed(client: EngineClient) -> bool:
    status = client.status()
    is_silent = status.run is not None and status.run.amplitude_vpp == 0.0
    # Nothing plays before an engine's first run, nor between two runs.
    is_between = status.state in (EngineState.RUNNING, EngineState.HELD) and status.run is None
    return is_silent or is_between or status.state not in SOUNDING


def _until(is_so: Callable[[], bool], within_s: float) -> bool:
    give_up_s, pause = monotonic() + within_s, Event()
    while not is_so():
        if monotonic() > give_up_s:
            return False
        pause.wait(LOOK_S)
    return True
