"""An attendant: a process that tells an engine that a program is there, whatever the program's threads do."""

import json
import os
import subprocess
import sys
from contextlib import suppress
from math import inf
from time import monotonic
from typing import IO

from ._announcement import EngineAddress
from ._client import Hello
from ._status import ConnectionRole

TOLD_EVERY_S = 0.02
"""More often a sign of life says nothing new [s]."""
AGAIN_S = 1.0
"""An attendant that has ended before its program is replaced, at most once in so long [s]."""


class Attendant:
    """Keeps an engine attended by a small process of its own, which sleeps most of the time.

    On a busy computer a thread of a window waits for Python's lock for a second and more, however often it
    would beat; a process that only sleeps and says a word is given a processor at once. It ends with the
    program that started it, falls silent while that is stopped by the system (Linux), and says with each beat
    for how long `live` has not been called.
    """

    def __init__(self, address: EngineAddress) -> None:
        hello = Hello(token=address.token, role=ConnectionRole.ATTENDING)
        told = {"address": [address.host, address.port], "hello": hello.model_dump_json()}
        self._first = json.dumps(told).encode() + b"\n"
        self._told_s = 0.0
        self._begin()

    @property
    def pid(self) -> int:
        """The attendant's process."""
        return self._process.pid

    def live(self) -> None:
        """Note that the program gets something done; it costs microseconds and waits for nobody."""
        now_s = monotonic()
        if now_s - self._told_s < TOLD_EVERY_S:
            return
        self._told_s = now_s
        try:
            os.write(self._pipe.fileno(), b".")
        except BlockingIOError:  # it stands still, and so does the engine's patience
            pass
        except OSError:
            if now_s - self._begun_s > AGAIN_S:
                self._end()
                self._begin()

    def close(self) -> None:
        """Attend no more. Legal at any time."""
        self._told_s = inf  # whatever `live` says from now on
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
            # A session of its own: Ctrl-C is not for it, and Linux shares processors among sessions.
            start_new_session=True,
        )
        assert self._process.stdin is not None
        self._pipe: IO[bytes] = self._process.stdin
        with suppress(OSError):
            self._pipe.write(self._first)
        if sys.platform != "win32":
            os.set_blocking(self._pipe.fileno(), False)
