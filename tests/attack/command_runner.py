"""Run commands one after another, each in a process with limits on time and memory.

Starting an interpreter and importing takes seconds. One process therefore imports everything and forks itself
for each command, so that no command affects the next one.
"""

import json
import os
import resource
import select
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Mapping
from dataclasses import asdict, replace
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Self

from .limits import MOST_BYTES, Case, Ending

ROOT = Path(__file__).resolve().parents[2]
GRACE_S = 2.0
"""Time after its time limit at which a hanging command is killed [s]."""
ADDRESS_ROOM_BYTES = 4 * MOST_BYTES
"""Address space beyond that of the imports [bytes]; it protects the computer only."""


class CommandRunner:
    """Runs cases; use it in a ``with`` block."""

    def __init__(self, variables: Mapping[str, str] = MappingProxyType({})) -> None:
        """Start the process that imports everything, with additional environment variables."""
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "200", "PYTHONUNBUFFERED": "1"}
        environment |= variables
        self._server = subprocess.Popen(
            [sys.executable, "-m", f"{__package__}.{Path(__file__).stem}"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=ROOT,
            env=environment,
        )

    def run(self, case: Case) -> Ending:
        """Run a case in a new folder, which is removed afterwards."""
        with tempfile.TemporaryDirectory(prefix="vibench_attack_") as name:
            case.write(Path(name))
            return self.run_in(Path(name), case)

    def run_in(self, folder: Path, case: Case) -> Ending:
        """Run ``vibench`` as described by a case in an existing folder."""
        before = _files(folder)
        asked = json.dumps({"folder": str(folder), **asdict(replace(case, files={}))})
        self._server.stdin.write(asked + "\n")
        self._server.stdin.flush()
        answer = self._server.stdout.readline()
        if not answer:
            raise RuntimeError("the process that forks for each command has ended")
        return Ending(**json.loads(answer), made=tuple(sorted(_files(folder) - before)))

    def close(self) -> None:
        """End the process that imported everything."""
        self._server.stdin.close()
        self._server.wait()
        self._server.stdout.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _files(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def serve() -> None:
    """Fork for each line of standard input, and print how the command ended."""
    import vibench.cli.environment  # noqa: I001 - numpy reads its setting, so it comes first
    import vibench.analysis
    import vibench.cli.__main__
    import vibench.cli.analyse
    import vibench.cli.files
    import vibench.cli.measure
    import vibench.cli.predict  # noqa: F401

    for line in sys.stdin:
        asked = json.loads(line)
        folder, case = Path(asked.pop("folder")), Case(**asked)
        print(json.dumps(run_command(folder, case)), flush=True)


def run_command(folder: Path, case: Case) -> dict[str, object]:
    """Run one command until it ends or its time is over."""
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        began = time.monotonic()
        number = os.fork()
        if number == 0:
            _become_command(folder, case, out.fileno(), err.fileno())
        status, usage = _wait(number, case.hangs_s)
        return {
            "code": os.waitstatus_to_exitcode(status),
            "took_s": usage.ru_utime + usage.ru_stime,
            "clock_s": time.monotonic() - began,
            "peak_bytes": usage.ru_maxrss * 1024,
            "out": _text(out),
            "err": _text(err),
        }


def _wait(number: int, hangs_s: float) -> tuple[int, resource.struct_rusage]:
    """Wait for a process to end; after the time limit kill it and all its children."""
    descriptor = os.pidfd_open(number)
    try:
        ready, _, _ = select.select([descriptor], [], [], hangs_s + GRACE_S)
    finally:
        os.close(descriptor)
    if not ready:
        os.killpg(number, signal.SIGKILL)
    _, status, usage = os.wait4(number, 0)
    return status, usage


def _text(file: object) -> str:
    file.seek(0)
    return file.read().decode(errors="replace")


def _become_command(folder: Path, case: Case, out: int, err: int) -> None:
    """Run a command in this forked process; never returns."""
    os.setpgid(0, 0)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(out, 1)
    os.dup2(err, 2)
    os.chdir(folder)
    room = _addresses_bytes() + ADDRESS_ROOM_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (room, room))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    sys.argv = ["vibench", *case.arguments]
    code, after = 1, None
    try:
        if case.prepare:
            after = import_module(case.prepare[0]).prepare(*case.prepare[1:])
        from vibench.cli.__main__ import main

        main()
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        traceback.print_exc()
    finally:
        if after is not None:
            after()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _addresses_bytes() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    return pages * resource.getpagesize()


if __name__ == "__main__":
    serve()
