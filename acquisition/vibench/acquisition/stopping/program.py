"""Announcements of programs that drive a bench, and stops of these programs from outside."""

import os
import platform
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from datetime import UTC, datetime
from logging import getLogger
from pathlib import Path
from stat import S_IMODE, S_ISREG
from threading import Event, Lock, Thread
from time import time
from types import FrameType
from typing import TypeVar

from pydantic import BaseModel, ConfigDict

from vibench.sim.operating_system.this import (
    OpenFile,
    Place,
    is_process,
    place_of,
    process_start,
    rename,
    state_folder,
)
from vibench.stop_files import answer_path, stop_path

from ..errors import AcquisitionError
from .stop import DRIVES_ON, MEMORY_RESERVE, Cause, DescriptorReserve, StopLevel, StopRequest, StopSwitch

# A stop is a file in the state folder and needs no connection; programs that drive a bench look for stops.
# The file's name gives process, start time and level. Even a full disk can store the name, and a process that
# cannot open more files can see it. If there is space, the file contains the reason (decision 0029).

SILENT_REASON = "a stop request in the state folder"
Press = Callable[[StopLevel, str], None]
"""Function that carries out a stop, given its level and its reason."""


def engines_folder() -> Path:
    """Return the private folder for announcements of programs and for stop files; create it if needed."""
    folder = state_folder() / "engines"
    folder.mkdir(mode=0o700, exist_ok=True)
    if S_IMODE(folder.stat().st_mode) != 0o700:
        folder.chmod(0o700)
    return folder


class KeptStops:
    """The stop files that are addressed to one process."""

    def __init__(self, pid: int, process_start: str, press: Press, folder: Path) -> None:
        self._paths = {
            level: Path(stop_path(str(folder), pid, process_start, level)) for level in reversed(StopLevel)
        }
        self._press = press
        self._obeyed: dict[Path, tuple[int, int]] = {}
        self._taken: set[Path] = set()
        """Stops that are being carried out, each given by the original path of its file."""
        self._reserve = DescriptorReserve()
        """Reserved file descriptor, released to read a reason even if no other descriptor is free."""
        self._reserve.hold()

    @classmethod
    def of_this_process(cls, press: Press) -> "KeptStops":
        """Return the stop files of this process; ``press`` is called to carry out a stop."""
        return cls(os.getpid(), process_start(os.getpid()) or "", press, engines_folder())

    def obey(self) -> None:
        """Carry out new stops, the hardest first, and confirm the stops that were carried out."""
        for level, path in self._paths.items():
            try:
                found = path.stat()
            except OSError:  # no stop of this level was requested, or the folder is missing
                continue
            mark = (found.st_ino, found.st_mtime_ns)
            if self._obeyed.get(path) == mark:
                continue
            self._obeyed[path] = mark  # Do this once, even if the file cannot be removed.
            # Do not read a pipe, which could wait for ever: read only regular files.
            self._press(level, self._reason(path) if S_ISREG(found.st_mode) else SILENT_REASON)
            self._taken.add(path)
            with suppress(OSError):
                _answer(path, "silent").unlink(missing_ok=True)  # this file answers an earlier stop
                rename(path, _answer(path, "taken"))
        self.confirm()

    def confirm(self) -> None:
        """Rename obeyed stop files when no drive is on; until then, update their times as a sign of life.

        If somebody has removed an obeyed stop file, write it again.
        """
        is_advancing = DRIVES_ON.take_advance()
        for path in tuple(self._taken):
            with suppress(OSError):  # somebody has removed the state folder
                if not DRIVES_ON:
                    with suppress(FileNotFoundError):
                        rename(_answer(path, "taken"), _answer(path, "silent"))
                    _answer(path, "silent").touch(0o600)
                    self._taken.discard(path)
                elif is_advancing:
                    _answer(path, "taken").touch(0o600)

    def close(self) -> None:
        """Release the reserved file descriptor."""
        self._reserve.release()

    def _reason(self, path: Path) -> str:
        self.close()
        try:
            return path.read_text(encoding="utf-8", errors="replace") or SILENT_REASON
        except OSError:  # another thread took the reserved descriptor
            return SILENT_REASON
        finally:
            with suppress(OSError):
                self._reserve.hold()


def _answer(stop: Path, answer: str) -> Path:
    return Path(answer_path(str(stop), answer))


INTERVAL_S = 0.05
"""Interval between two calls of a watchdog [s]."""
LEFT_ALONE_S = 1.0
FRESH_S = 60.0
"""Age up to which a confirmation of silence is kept after its program has ended [s]."""


class Watchdog:
    """Thread that calls a function every `INTERVAL_S`, until closed.

    Raises AcquisitionError when the system provides no thread.
    """

    def __init__(self, look: Callable[[], None], name: str) -> None:
        self._look = look
        self._closing = Event()
        self._thread = Thread(target=self._run, name=name, daemon=True)
        try:
            self._thread.start()
        except RuntimeError as error:
            raise AcquisitionError(
                f"this process can start no more threads ({error}), but the {name} needs a thread. "
                "Nothing was played; end other programs, or raise the limit (ulimit -u)"
            ) from error

    def close(self) -> None:
        """Stop the calls; a call that hangs, for example in a lost network folder, is abandoned."""
        self._closing.set()
        self._thread.join(LEFT_ALONE_S)

    def _run(self) -> None:
        while not self._closing.is_set():
            try:
                if not self._closing.wait(INTERVAL_S):
                    self._look()
            except MemoryError:  # do not log: this would need more memory
                MEMORY_RESERVE.release()
            except Exception:
                getLogger(__name__).exception("%s", self._thread.name)


class Program(BaseModel):
    """Announcement of a program that drives a bench, or may do so at any moment."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    pid: int
    what: str
    """Purpose of the program: a campaign's name, or ``"window"``."""
    started_utc: str
    process_start: str = ""
    """Start time of the process, from the system; unique together with the number, which may be reused."""
    computer: str = ""
    """Name of the computer; several computers may share a home folder with the state folder."""
    rigs: tuple[str, ...] = ()
    """Generators of the rigs whose benches the process has opened."""

    @property
    def place(self) -> Place:
        """Where the program runs: here, or in another container or computer that shares the state folder."""
        return place_of(self.process_start)

    @property
    def is_alive(self) -> bool:
        """Whether the process is alive, even if it does not respond."""
        if self.place is Place.HERE:
            return is_process(self.pid, self.process_start)
        try:
            with closing(OpenFile(_path(self))) as file:
                return not file.is_locked_alone()
        except OSError:  # the file was removed, or the file system does not support locks
            return False

    @property
    def was_killed(self) -> bool:
        """Whether the process has ended without removing its announcement."""
        return not self.is_alive and _path(self).exists()


_RIGS: set[str] = set()
"""Generators of all rigs whose benches this process has opened."""

AnyProgram = TypeVar("AnyProgram", bound=Program)


def facts_of_this_process(what: str) -> dict[str, object]:
    """Return the fields of `Program` for this process, with ``what`` as its purpose."""
    pid = os.getpid()
    return {
        "pid": pid,
        "what": what,
        "started_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "process_start": process_start(pid) or "",
        "computer": platform.node(),
    }


def announced_programs(model: type[AnyProgram]) -> tuple[AnyProgram, ...]:
    """Return all programs running on this computer (or in this container), oldest first, as ``model``.

    Raises AcquisitionError when there is no state folder and none can be created.
    """
    found = []
    for announcement in _announcements(model):
        # The computer's name may change while a program runs; the program's number and start time do not.
        is_here = announcement.place is Place.HERE and (
            announcement.computer in ("", platform.node()) or announcement.process_start != ""
        )
        if is_here and announcement.is_alive:
            found.append(announcement)
    _sweep()
    return tuple(sorted(found, key=lambda each: each.started_utc))


def unconfirmed_programs() -> tuple[Program, ...]:
    """Return the programs that ended here without confirming silence, even before the last boot.

    `note_open_bench` removes them. Raises AcquisitionError in the same cases as `announced_programs`.
    """
    dead = (each for each in _announcements(Program) if not each.is_alive)
    return tuple(each for each in dead if each.computer == platform.node() or not each.computer)


def note_open_bench(rig: str) -> None:
    """Register that this process has silenced the generator ``rig``; forget ended programs that drove it."""
    _RIGS.add(rig)
    with suppress(AcquisitionError, OSError):  # without a state folder, no earlier program is known
        for each in unconfirmed_programs():
            if rig in each.rigs or not each.rigs:
                withdraw(each)
        _sweep()
    _REACHED.announce_again()


def programs_of_other_places() -> tuple[Program, ...]:
    """Return all programs running in other containers or computers that share the state folder.

    Raises AcquisitionError in the same cases as `announced_programs`.
    """
    others = (each for each in _announcements(Program) if each.place is not Place.HERE)
    return tuple(sorted((each for each in others if each.is_alive), key=lambda each: each.started_utc))


def _announcements(model: type[AnyProgram]) -> Iterator[AnyProgram]:
    try:
        # Do not use glob, which finds nothing in a folder without read permission, and raises no error.
        paths = sorted(engines_folder().iterdir())
    except OSError as error:
        raise AcquisitionError(
            f"the state folder cannot be searched for programs that drive a bench ({error}); set "
            "VIBENCH_STATE_DIR to the program's state folder. In an emergency, switch the amplifier off"
        ) from error
    for path in paths:
        if path.suffix != ".json" or not path.is_file():  # reading a pipe would block
            continue
        try:
            yield model.model_validate_json(_read_announcement(path))
        except (ValueError, OSError):  # a file of another version or type, or a removed file
            continue


def _read_announcement(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except PermissionError:  # for example a file of root; stopping needs only write access to the folder
        pid, start, _ = path.name.split(".")
        facts = Program(pid=int(pid), what="a program of another user", started_utc="", process_start=start)
        return facts.model_dump_json().encode()


def withdraw(program: Program) -> None:
    """Remove a program's announcement, if it exists; ignore a failure."""
    with suppress(OSError):
        _path(program).unlink()


class _StopTargets:
    """Activities of this process that a stop from outside ends: an engine, runs, checks.

    Only the oldest activity is announced, but a stop ends all; the announcement of an engine covers its runs.
    """

    def __init__(self) -> None:
        self._inside: list[tuple[Press, Program]] = []
        self._kept: KeptStops | None = None
        self._mark: OpenFile | None = None
        """File lock that shows other containers that this process is alive."""
        self._watchdog: Watchdog | None = None
        self._changing = Lock()

    def enter(self, entry: tuple[Press, Program]) -> None:
        """Add an entry; raise OSError when the state folder cannot be written."""
        with self._changing:
            if not self._inside:
                kept = KeptStops.of_this_process(self._press)
                try:
                    self._announce(entry[1])
                except OSError:
                    kept.close()
                    raise
                self._kept, self._watchdog = kept, Watchdog(self._look, "kept stops")
            self._inside.append(entry)

    def leave(self, entry: tuple[Press, Program]) -> None:
        """Remove an entry; after the last entry, stop checking for stop files."""
        with self._changing:
            spoke = self._inside[0] is entry
            self._inside = [each for each in self._inside if each is not entry]
            if self._inside and spoke:
                with suppress(OSError):
                    self._announce(self._inside[0][1])
            if self._inside:
                return
            self._unmark()
            watchdog, kept, self._watchdog, self._kept = self._watchdog, self._kept, None, None
        if watchdog is not None and kept is not None:
            watchdog.close()
            kept.confirm()
            kept.close()
        if not DRIVES_ON:
            withdraw(entry[1])

    def announce_again(self) -> None:
        """Add newly opened rigs to the announcement of this process; ignore a failure."""
        with self._changing, suppress(OSError):
            if self._inside:
                self._announce(self._inside[0][1])

    def _look(self) -> None:
        """Carry out new stops, and repeat the announcement if somebody has emptied the state folder."""
        kept, inside = self._kept, self._inside
        if kept is None or not inside:
            return
        kept.obey()
        with suppress(OSError):
            if not _path(inside[0][1]).exists():
                with self._changing:
                    if self._inside:
                        self._announce(self._inside[0][1])
            elif self._mark is None:
                with self._changing:
                    if self._inside:
                        self._mark = _lock(_path(self._inside[0][1]))

    def _announce(self, program: Program) -> None:
        self._unmark()  # Windows cannot replace an open file
        self._mark = _lock(_write(program.model_copy(update={"rigs": tuple(sorted(_RIGS))})))

    def _unmark(self) -> None:
        mark, self._mark = self._mark, None
        if mark is not None:
            mark.close()

    def _press(self, level: StopLevel, reason: str) -> None:
        for press, _ in tuple(self._inside):
            press(level, reason)


_REACHED = _StopTargets()


@contextmanager
def announce_program(press: Press, program: Program) -> Iterator[None]:
    """Announce ``program`` inside the context; ``press`` is called for each stop that other programs request.

    Raises AcquisitionError when the state folder cannot be written, because a program that is not announced
    cannot be stopped from outside.
    """
    entry = (press, program)
    try:
        _REACHED.enter(entry)
    except OSError as error:
        raise AcquisitionError(
            f"{program.what} cannot be entered in the state folder ({error}), so no other program could stop "
            "it. Nothing was started; make room in that folder, or set VIBENCH_STATE_DIR to another folder"
        ) from error
    try:
        yield
    finally:
        _REACHED.leave(entry)


def _path(program: Program) -> Path:
    return engines_folder() / f"{program.pid}.{program.process_start}.json"


def _lock(path: Path) -> OpenFile | None:
    """Return a file that stays locked while this process lives; None if the file cannot be locked."""
    try:
        file = OpenFile(path)
    except OSError:
        return None
    try:
        if file.is_locked_alone():
            return file
    except OSError:  # the file system does not support locks
        pass
    file.close()
    return None


def _write(program: Program) -> Path:
    path = _path(program)
    coming = path.with_suffix(".coming")
    coming.unlink(missing_ok=True)  # Left by a killed process with the same number.
    # Nobody else may ever read the token in the file, so create the file with its final mode.
    descriptor = os.open(coming, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    try:
        with os.fdopen(descriptor, "w", encoding="utf-8") as file:
            file.write(program.model_dump_json())
        rename(coming, path)  # readers never see an incomplete file
    except OSError:
        coming.unlink(missing_ok=True)  # on a full disk, an empty file may remain
        raise
    return path


def _sweep() -> None:
    """Remove files of processes that have ended; file names begin with the process number.

    Confirmations of silence stay for a minute, because the sender of a stop may not have read them yet.
    """
    folder, fresh_s = engines_folder(), time() - FRESH_S
    for path in folder.iterdir():
        pid, _, rest = path.name.partition(".")
        start, _, rest = rest.rpartition(".")
        is_kept = (folder / f"{pid}.{start}.json").exists() or place_of(start) is not Place.HERE
        if rest.startswith("silent-"):
            with suppress(OSError):
                if path.stat().st_mtime < fresh_s:
                    path.unlink()
        elif not is_kept and pid.isdecimal() and not is_process(int(pid), start):
            with suppress(OSError):
                path.unlink()


LEFT_TO_THE_DEAD_MAN = ("SIGKILL", "SIGSTOP", "SIGSEGV", "SIGBUS", "SIGFPE", "SIGILL")
"""Signals that are not handled: the first two cannot be caught; the others recur when a handler returns."""
_HARMLESS = ("SIGCHLD", "SIGCLD", "SIGURG", "SIGWINCH", "SIGCONT", "SIGINFO")
"""Signals that neither end nor suspend a process by default."""
_PAUSES = ("SIGTSTP", "SIGTTIN", "SIGTTOU")
"""Signals that suspend a process, as Ctrl-Z does; a terminal may send the last two repeatedly."""
_ALWAYS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGBREAK", "SIGXCPU")
"""Signals that are always handled; other signals are handled only if the program itself does not."""


@contextmanager
def stop_on_signal(switch: StopSwitch, what: str = "a script") -> Iterator[None]:
    """Inside the context, request a stop of ``switch`` on a signal or a stop file of another program.

    ``vibench stop`` finds the program under the name ``what`` and leaves a stop file in the state folder.
    Stop files work in any thread. Python delivers signals only to the main thread. There, every signal that
    would end or suspend the program requests a stop (`stop_signals`). SIGHUP stays ignored if it was ignored
    before (nohup), because such a run is meant to continue.

    The first signal ramps down and ends the run as stopped: Ctrl-C with the planned ramp, the others faster.
    A second signal raises KeyboardInterrupt, which silences the generator without the measured ramp. Later
    signals, and a second Ctrl-Z, are ignored, so that repeated key presses cannot interrupt the silencing.

    Raises AcquisitionError when the state folder cannot be written, because a program that is not announced
    cannot be stopped from outside.
    """

    def press(level: StopLevel, reason: str) -> None:
        switch.ask(StopRequest(Cause.OPERATOR, level, reason))

    program = Program.model_validate(facts_of_this_process(what))
    with _signals(switch), announce_program(press, program):
        yield


@contextmanager
def _signals(switch: StopSwitch) -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    received: list[int] = []

    def on_signal(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - the signature is Python's
        name = signal_name(number)
        if name in _PAUSES:
            signal.signal(number, signal.SIG_IGN)
        received.append(number)
        match len(received):
            case 1:
                cause = Cause.KEYBOARD if name == "SIGINT" else Cause.TERMINATED
                switch.ask(StopRequest.of(cause, f"{name}: stopped from the keyboard or by the system"))
            case 2:
                raise KeyboardInterrupt

    before = {number: signal.signal(number, on_signal) for number in stop_signals()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def signal_name(number: int) -> str:
    """Return the name of a signal, or its number for a real-time signal, which has no name."""
    known = {each.value: each.name for each in signal.Signals}
    return known.get(number, f"signal {number}")


def stop_signals() -> list[int]:
    """Return the signals that request a stop during a drive: those that would end or suspend the process.

    Signals that the program handles or ignores itself are left out, and so are the signals in
    `LEFT_TO_THE_DEAD_MAN`, which cannot be handled.
    """
    return [number for number in sorted(signal.valid_signals()) if _is_heeded(number)]


def _is_heeded(number: int) -> bool:
    name, handler = signal_name(number), signal.getsignal(number)
    if name in LEFT_TO_THE_DEAD_MAN or name in _HARMLESS:
        return False
    if name in _ALWAYS:
        return name != "SIGHUP" or handler is not signal.SIG_IGN
    # Replace a handler of this module, which belongs to an outer run with another switch.
    return handler is signal.SIG_DFL or getattr(handler, "__module__", "") == __name__
