"""Entry point of the `vibench` command, with a fast path for `vibench stop`.

The drive stays on until `vibench stop` acts, and loading all libraries takes half a second of processor time.
This module therefore imports only the standard library. In special cases, and on operating systems other than
Linux, the complete command is used.
"""

import gc
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from functools import partial

from vibench.stop_files import SWITCH_OFF, Fate, fate_of, stop_path, write_stop_file

LEVELS = ("ramp", "abort", "off")


class RunningProgram:
    """Running program that has announced itself by a file named after process id and start time."""

    def __init__(self, path: str, pid: str, start: str, is_alive: Callable[[], bool]) -> None:
        self.path = path
        self.pid = pid
        self.start = start
        self.is_alive = is_alive
        try:
            with open(path, "rb") as file:  # noqa: PTH123 - pathlib takes 8 ms to load
                self._facts = file.read()  # read at once, before the program can remove the file
        except OSError:
            self._facts = b""

    def fact(self, name: str) -> str:
        """Return a field of the program's announcement; empty if the field is unknown."""
        import json

        try:
            return str(json.loads(self._facts)[name])
        except (ValueError, KeyError, TypeError):
            return ""

    def name(self) -> str:
        """Return the program's task and process id, in printable characters."""
        what = self.fact("what") or "a program of another user"
        shown = (each if each.isprintable() else each.encode("unicode_escape").decode() for each in what)
        return f"{''.join(shown)}, process {self.pid}"


def main() -> None:
    """Stop programs if the arguments are a simple stop command; otherwise run the complete command."""
    if sys.argv[1:2] == ["stop"] and sys.platform == "linux":
        request = parse_stop(sys.argv[2:])
        code = None if request is None else stop_programs(*request)
        if code is not None:
            sys.exit(code)
    # Keep pydantic from searching every installed package for plug-ins: vibench uses none.
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    gc.set_threshold(10_000)  # collect garbage less often: this took 1/5 of the start-up time
    from vibench.cli import main as run_command

    run_command()


def parse_stop(words: Sequence[str]) -> tuple[str, str, str] | None:
    """Return level, reason and process id of a simple stop command; None for all other arguments."""
    split = [part for word in words for part in (word.split("=", 1) if word[:2] == "--" else [word])]
    given = dict(zip(split[::2], split[1::2], strict=False))
    if len(split) != 2 * len(given) or not given.keys() <= {"--level", "--reason", "--pid"}:
        return None
    level, reason = given.get("--level", "ramp"), given.get("--reason", "vibench stop")
    is_plain = level in LEVELS and reason and given.get("--pid", "0").isdecimal()
    return (level, reason, given.get("--pid", "")) if is_plain else None


def stop_programs(level: str, reason: str, pid: str) -> int | None:
    """Stop the selected programs; return the exit code, or None if the complete command is needed."""
    try:
        programs = [each for each in running_programs() if pid in ("", each.pid)]
        living = [each for each in programs if each.is_alive()]
        stops = [stop_path(os.path.dirname(each.path), each.pid, each.start, level) for each in living]  # noqa: PTH120
        for stop in stops:
            write_stop_file(stop, reason)
    except OSError:
        return None
    fates = [fate_of(stop, each.is_alive) for each, stop in zip(living, stops, strict=True)]
    if not programs or any(
        fate is Fate.NOT_TAKEN and each.is_alive() for each, fate in zip(living, fates, strict=True)
    ):
        return None
    for each, fate in zip(living, fates, strict=True):
        if fate is Fate.SILENT:
            print(f"{each.name()}, has carried out the stop ({level}); its output is off.")  # noqa: T201
    unconfirmed = [each for each in programs if each not in living]
    unconfirmed += [each for each, fate in zip(living, fates, strict=True) if fate is not Fate.SILENT]
    for each in unconfirmed:
        what = "has not confirmed" if each.is_alive() else "ended without confirming"
        print(f"error: {each.name()}, {what} that its output is off. {SWITCH_OFF}.", file=sys.stderr)  # noqa: T201
    return 1 if unconfirmed else 0


def running_programs() -> Iterator[RunningProgram]:
    """Yield the announced running programs; raise OSError if one of them is on another computer."""
    folder = os.path.join(_state_folder(), "engines")  # noqa: PTH118
    boot, space = _own_place()
    for name in sorted(os.listdir(folder)):  # noqa: PTH208
        pid, _, rest = name.partition(".")
        start, _, suffix = rest.rpartition(".")
        path = os.path.join(folder, name)  # noqa: PTH118
        if suffix != "json" or not pid.isdecimal() or not os.path.isfile(path):  # noqa: PTH113 - as above
            continue
        is_here = start.startswith(f"{boot}_{space}_")
        look = partial(_is_process, pid, start.split("_")[-1]) if is_here else partial(_is_locked, path)
        if not start.startswith(f"{boot}_") and look():
            raise OSError("on another computer")
        program = RunningProgram(path, pid, start, look)
        # Include programs in other containers, and those that ended before the last boot of this computer.
        if is_here or look() or program.fact("computer") == os.uname().nodename:
            yield program


def _state_folder() -> str:
    home = os.path.expanduser("~/.local/state")  # noqa: PTH111
    usual = os.path.join(home, os.environ.get("XDG_STATE_HOME", ""), "vibench")  # noqa: PTH118
    return os.environ.get("VIBENCH_STATE_DIR") or usual


def _own_place() -> tuple[str, str]:
    with open("/proc/sys/kernel/random/boot_id", encoding="ascii") as file:  # noqa: PTH123
        return file.read(8), str(os.stat("/proc/self/ns/pid").st_ino)  # noqa: PTH116


def _is_process(pid: str, start: str) -> bool:
    """Return whether the process with this id and start time (see proc(5)) is running."""
    try:
        with open(f"/proc/{pid}/stat", encoding="ascii", errors="replace") as file:  # noqa: PTH123
            state, *others = file.read().rpartition(")")[2].split()
    except OSError:
        return False
    return state not in "ZX" and others[18] == start


def _is_locked(path: str) -> bool:
    """Return whether a file is locked; the program that created the file locks it while running."""
    import fcntl

    try:
        with open(path, "rb+") as file:  # noqa: PTH123
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except FileNotFoundError:  # the program has ended
        pass
    return False
