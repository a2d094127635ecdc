"""The process of the live twin: started and ended by an engine, which never waits for it.

It is a viewer like any other (`vibench twin`, reached by name as a virtual rig is): it pulls samples, tells
what it found, and keeps nothing running. When it is too slow it misses samples; the recording does not.
"""

import os
import subprocess
import sys
from enum import StrEnum

ENDING_S = 2.0


class TwinSwitch(StrEnum):
    """Whether the live twin runs beside a measurement."""

    OFF = "off"
    ON = "on"


class TwinProcess:
    """The live twin of this process' engine."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[str] | None = None

    @property
    def is_on(self) -> bool:
        """Whether it was started; it may have ended since."""
        return self._process is not None

    def turn(self, switch: TwinSwitch) -> None:
        """Start or end it. Legal in every state."""
        match switch:
            case TwinSwitch.ON if self._process is None:
                self._process = subprocess.Popen(  # noqa: S603 - this interpreter, and nothing of a user's
                    [sys.executable, "-m", "vibench.cli", "twin", "--pid", str(os.getpid())],
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.PIPE,
                    text=True,
                    # Ctrl-C in a terminal is for whoever shows the run.
                    start_new_session=True,
                )
            case TwinSwitch.OFF if self._process is not None:
                process, self._process = self._process, None
                process.terminate()
                try:
                    process.wait(ENDING_S)
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.wait()
                if process.stderr is not None:
                    process.stderr.close()

    def last_words(self) -> str | None:
        """Say why it has ended by itself, once; None while it runs or is off."""
        process = self._process
        if process is None or process.poll() is None:
            return None
        self._process = None
        with process:
            said = "" if process.stderr is None else process.stderr.read().strip()
        return said.splitlines()[-1] if said else f"code {process.returncode}"
