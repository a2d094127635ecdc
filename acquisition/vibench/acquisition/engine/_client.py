"""Functions and classes that start, find, attend and stop engines of this user, and send requests to them."""

import json
import os
import socket
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, suppress
from enum import StrEnum
from math import inf
from pathlib import Path
from threading import Event, Lock
from time import monotonic
from typing import IO, Any, Literal

from vibench.sim.operating_system.this import Place, state_folder
from vibench.stop_files import HEEDED_S, SWITCH_OFF, Fate, fate_of, stop_path, write_stop_file

from .. import errors
from ..campaign import ExistingRecordings
from ..errors import AcquisitionError
from ..host.beside import ClosedOnLeaving
from ..host.toml_file import FrozenModel, member
from ..plan import Campaign
from ..stopping.program import (
    Press,
    Program,
    announce_program,
    announced_programs,
    engines_folder,
    facts_of_this_process,
    programs_of_other_places,
    unconfirmed_programs,
    withdraw,
)
from ..stopping.stop import StopLevel
from ._request_handler import RequestHandler
from ._status import SOUNDING, ArmedPlan, ConnectionRole, EngineState, EngineStatus, RowStatus, Supervision
from ._verbs import CampaignRequest, Verb, sent
from ._wire import ANSWERS, EngineError, EngineGone, EngineSilent, Message, receive, send


class EngineAddress(FrozenModel):
    """Address of an engine, and the token that admits a connection."""

    host: str
    port: int
    token: str


REFUSAL_S = 0.2
"""Time limit of a connection attempt [s]; on the same computer, a refusal is returned at once."""


class Announcement(Program):
    """An engine of this user on this computer; an engine accepts all requests, not only requests to stop."""

    address: EngineAddress


def announce(address: EngineAddress, what: str, press: Press) -> AbstractContextManager[None]:
    """Let `announced_engines` find this engine within the context; ``press`` is called for each stop file.

    Raises AcquisitionError when the state folder cannot be written: an unannounced engine cannot be stopped.
    """
    announcement = Announcement.model_validate({**facts_of_this_process(what), "address": address})
    return announce_program(press, announcement)


def announced_engines() -> tuple[Announcement, ...]:
    """Return all engines on this computer whose process runs, oldest first, even if they do not answer.

    Engines that refuse connections are left out; `programs_without_engine` returns those that still run.
    """
    found = []
    for announcement in announced_programs(Announcement):
        if not _refuses(announcement.address):
            found.append(announcement)
        elif not announcement.process_start:
            withdraw(announcement)
    return tuple(found)


def programs_without_engine() -> tuple[Program, ...]:
    """Return all programs that drive a bench without an engine, and all engines that refuse connections."""
    engines = {each.pid for each in announced_engines()}
    return tuple(each for each in announced_programs(Program) if each.pid not in engines)


def the_engine(pid: int | None) -> Announcement:
    """Return the engine with the process number ``pid``; if ``pid`` is None, return the only engine.

    Raises EngineError when there is no such engine, or several engines and ``pid`` is None.
    """
    chosen = [each for each in announced_engines() if pid in (None, each.pid)]
    if len(chosen) > 1:
        raise EngineError(f"several programs drive a bench: {_names(chosen)}; select one with --pid")
    if chosen:
        return chosen[0]
    wanted = "no engine is running" if pid is None else f"no engine runs as process {pid}"
    others = [each for each in programs_without_engine() if pid in (None, each.pid)]
    if others:
        raise EngineError(f"{wanted}; {_names(others)} drives a bench without an engine: use 'vibench stop'")
    raise EngineError(
        f"{wanted}; 'vibench measure' and 'vibench gui' start an engine. Only {state_folder()} was searched: "
        "engines of other users, or with another VIBENCH_STATE_DIR, are not found"
        + "".join(f". {each}" for each in [out_of_reach()] if each)
    )


def programs_to_stop(pid: int | None) -> tuple[Program, ...]:
    """Return the programs that a stop addresses: engines, and programs that drive a bench themselves.

    Programs in other containers of this computer are included, since they read the same state folder, and so
    are programs that ended without confirming silence. Raises EngineError when there is no such program.
    ``pid`` selects one program; None selects all programs of this computer.
    """
    contained = (each for each in programs_of_other_places() if each.place is Place.CONTAINER)
    programs = (*announced_engines(), *programs_without_engine(), *contained, *unconfirmed_programs())
    return tuple(each for each in programs if pid in (None, each.pid)) or (the_engine(pid),)


def out_of_reach() -> str:
    """Return a sentence about programs on other computers that use the same state folder, or empty text."""
    others = [each for each in programs_of_other_places() if each.place is Place.ELSEWHERE]
    named = ", ".join(f"{each.what} (process {each.pid} on {each.computer})" for each in others)
    return f"Programs on other computers were not reached: {named}; run 'vibench stop' there" if named else ""


def require_ended(engine: Announcement) -> None:
    """Refuse to continue after an engine was killed, because its output is not confirmed to be off.

    Raises EngineGone when the announced ``engine`` was killed, with the advice to switch the amplifier off.
    """
    if engine.was_killed:
        raise EngineGone(f"The engine was killed. {SWITCH_OFF}")


def _names(programs: Sequence[Program]) -> str:
    return ", ".join(f"{each.pid} ({each.what})" for each in programs)


def _refuses(address: EngineAddress) -> bool:
    """Whether the engine refuses the connection; a slow or busy engine does not refuse."""
    try:
        socket.create_connection((address.host, address.port), REFUSAL_S).close()
    except ConnectionRefusedError:
        return True
    except OSError:
        return False
    return False


PATIENCE_S = 5.0
"""Longest wait for an answer from the engine, which usually answers within milliseconds [s]."""


class Hello(FrozenModel):
    """The first message from a client on every connection."""

    ask: Literal["hello"] = "hello"
    token: str
    role: ConnectionRole = ConnectionRole.VISITING


def connect(address: EngineAddress, role: ConnectionRole, patience_s: float = PATIENCE_S) -> socket.socket:
    """Return a connection to a running engine; ``patience_s`` [s] limits the wait for each answer."""
    hello = Hello(token=address.token, role=role)
    try:
        connection = socket.create_connection((address.host, address.port), patience_s)
    except TimeoutError as error:
        raise _silent(patience_s) from error
    except OSError as error:
        raise EngineGone(
            f"no engine answers at {address.host}:{address.port} ({error}); check that the engine still "
            "runs, or start an engine"
        ) from error
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    try:
        exchange(connection, Message(hello.model_dump_json().encode()))
    except AcquisitionError:
        connection.close()
        raise
    return connection


def exchange(
    connection: socket.socket, request: Message, work_s: float = 0.0
) -> tuple[dict[str, Any], bytes]:
    """Send a request and return its answer: the parsed JSON text, and the bytes after it.

    ``work_s`` [s] is added to the longest wait for an answer on this connection.

    Raises
    ------
    EngineSilent
        When no answer comes in time; the connection is then closed.
    EngineGone
        When the connection has ended; it is then closed on this side, too.
    AcquisitionError
        When the engine refuses the request; the error is the engine's own error.
    """
    usual_s = connection.gettimeout()
    patience_s = (usual_s or PATIENCE_S) + work_s
    try:
        send(connection, request)
        connection.settimeout(patience_s)
        answer = receive(connection, ANSWERS)
        connection.settimeout(usual_s)
    except TimeoutError as error:
        # Close the connection: a late answer would be taken for the answer to the next request.
        connection.close()
        raise _silent(patience_s) from error
    except OSError as error:
        connection.close()
        raise EngineGone(
            f"the engine was killed, or closed this connection ({error}). {SWITCH_OFF}"
        ) from error
    facts = json.loads(answer.text)
    if "refused" in facts:
        raise _refusal(facts["kind"], facts["refused"])
    return facts, answer.payload


def _silent(patience_s: float) -> EngineSilent:
    return EngineSilent(
        f"the engine does not answer within {patience_s:g} s; its process hangs or is suspended. The output "
        "may stay on: 'vibench stop' requests a stop that the engine obeys when it runs again; in an "
        "emergency, switch the amplifier off by hand"
    )


def _refusal(kind: str, sentence: str) -> AcquisitionError:
    """Return an engine's error in its own class, or as EngineError if that class is unknown."""
    known = getattr(errors, kind, None)
    if isinstance(known, type) and issubclass(known, AcquisitionError):
        return known(sentence)
    return EngineError(sentence)


class EngineClient(ClosedOnLeaving):
    """A connection to an engine.

    Every request over an attending connection shows that a viewer is present: an attended run
    continues only with at least two requests per second. Each method raises `EngineGone` when the engine's
    process has ended, and the engine's own `AcquisitionError` when the engine refuses the request.
    """

    open = sent(RequestHandler.open)
    close_bench = sent(RequestHandler.close_bench)
    check = sent(RequestHandler.check)
    arm_request = sent(RequestHandler.arm_request)
    disarm = sent(RequestHandler.disarm)
    start = sent(RequestHandler.start)
    stop = sent(RequestHandler.stop)
    resume = sent(RequestHandler.resume)
    mark = sent(RequestHandler.mark)
    note_change = sent(RequestHandler.note_change)
    open_rig = sent(RequestHandler.open_rig)
    last_request = sent(RequestHandler.last_request)
    turn_twin = sent(RequestHandler.turn_twin)
    publish_twin = sent(RequestHandler.publish_twin)
    status_since = sent(RequestHandler.status_since)
    heartbeat = sent(RequestHandler.heartbeat)
    look = sent(RequestHandler.look)
    shutdown = sent(RequestHandler.shutdown)

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self._asking = Lock()
        self._rows: tuple[int, tuple[RowStatus, ...]] = (-1, ())

    @classmethod
    def attach(
        cls,
        address: EngineAddress,
        role: ConnectionRole | str = ConnectionRole.VISITING,
        patience_s: float = PATIENCE_S,
    ) -> "EngineClient":
        """Connect to a running engine, to watch or to attend its run.

        Raises EngineSilent when the engine does not answer this or a later request within ``patience_s`` [s],
        and EngineGone when no engine listens at the address.
        """
        return cls(connect(address, member(ConnectionRole, role), patience_s))

    def status(self) -> EngineStatus:
        """Return the status of the engine."""
        number, rows = self._rows
        status = self.status_since(number)
        if status.rows_number == number:
            return status.model_copy(update={"rows": rows})
        self._rows = (status.rows_number, status.rows)
        return status

    def arm(
        self, campaign: Campaign, folder: Path, existing: ExistingRecordings | str = ExistingRecordings.REFUSE
    ) -> ArmedPlan:
        """Prepare a campaign; `arm_request` accepts all options."""
        return self.arm_request(
            CampaignRequest(campaign=campaign, folder=folder, existing=member(ExistingRecordings, existing))
        )

    def close(self) -> None:
        """End the connection; the engine continues. May be called at any time."""
        self._connection.close()

    def ask(self, verb: Verb, arguments: Mapping[str, object]) -> Any:
        """Send a request and wait for its answer."""
        request = verb.message(**arguments)
        with self._asking:
            return verb.answer(*exchange(self._connection, request, verb.work_s))


BEAT_EVERY_S = 0.02
"""Shortest interval between bytes that `Attendant.live` sends [s]."""
AGAIN_S = 1.0
"""Shortest interval between restarts of an attendant process that ended too early [s]."""


class Attendant:
    """Small separate process that sends heartbeats to an engine, and sleeps most of the time.

    On a busy computer, a thread of a window can wait a second or more for Python's global lock. A process
    that mostly sleeps gets a processor at once (decision 0068). The process ends with the parent program. It
    sends no heartbeat while the operating system has suspended the parent program (Linux). Each heartbeat
    reports how long `live` has not been called.
    """

    def __init__(self, address: EngineAddress) -> None:
        hello = Hello(token=address.token, role=ConnectionRole.ATTENDING)
        message = {"address": [address.host, address.port], "hello": hello.model_dump_json()}
        self._first = json.dumps(message).encode() + b"\n"
        self._beat_s = 0.0
        self._begin()

    @property
    def pid(self) -> int:
        """Process number of the attendant."""
        return self._process.pid

    def live(self) -> None:
        """Report that the program is responsive. The call takes microseconds and never waits."""
        now_s = monotonic()
        if now_s - self._beat_s < BEAT_EVERY_S:
            return
        self._beat_s = now_s
        try:
            os.write(self._pipe.fileno(), b".")
        except BlockingIOError:  # the pipe is full: the attending process does not read
            pass
        except OSError:
            if now_s - self._begun_s > AGAIN_S:
                self._end()
                self._begin()

    def close(self) -> None:
        """Stop attending the engine. May be called at any time."""
        self._beat_s = inf  # after this, `live` sends nothing
        self._end()

    def _end(self) -> None:
        self._process.kill()
        self._process.wait()
        with suppress(OSError):
            self._pipe.close()

    def _begin(self) -> None:
        self._begun_s = monotonic()
        self._process = subprocess.Popen(
            [sys.executable, "-m", "vibench.acquisition.engine._attending"],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            bufsize=0,
            # Ctrl-C does not reach a separate session, and Linux shares processors among sessions.
            start_new_session=True,
        )
        assert self._process.stdin is not None
        self._pipe: IO[bytes] = self._process.stdin
        with suppress(OSError):
            self._pipe.write(self._first)
        if sys.platform != "win32":
            os.set_blocking(self._pipe.fileno(), False)


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


STOP_PATIENCE_S = 1.0
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
    with EngineClient.attach(engine.address, patience_s=STOP_PATIENCE_S) as client:
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
