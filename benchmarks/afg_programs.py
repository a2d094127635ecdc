"""Run third-party programs for the AFG1022 unchanged on the simulated generator, and count refused messages.

    python benchmarks/afg_programs.py PROGRAM.py [PROGRAM.py ...]

Each program or test file runs in a separate process. The simulated generator is the only instrument that
pyvisa finds, at the USB address that the program names. Nothing else is changed.
"""

import argparse
import os
import re
import runpy
import subprocess
import sys
from collections import Counter
from pathlib import Path

from vibench.virtual_rig.generator.afg1022 import AFG1022
from vibench.virtual_rig.generator.scpi_instrument import Reply
from vibench.virtual_rig.generator.scpi_message import ErrorCode, Status
from vibench.virtual_rig.usb.bus import plug_in
from vibench.virtual_rig.usb.usbtmc import UsbTmcInstrument

ADDRESS = re.compile(r"0x0699::0x0353::(\w+)")
LONGEST = 70
"""Largest number of bytes shown of a message, because a waveform has thousands."""


class CountingQueue(Status):
    """Error queue that also counts the errors of each message."""

    def __init__(self) -> None:
        super().__init__()
        self.message = ""
        self.refused: Counter[str] = Counter()

    def report(self, code: ErrorCode) -> None:
        """Queue an error."""
        self.refused[f"{self.message}: {code.name}"] += 1
        super().report(code)


class Overheard(AFG1022):
    """Simulated generator that records its messages and the errors they cause."""

    def __init__(self, serial: str) -> None:
        super().__init__(lambda: 0.0, serial=serial)
        self.status: CountingQueue = CountingQueue()
        self.messages = 0

    def execute(self, message: bytes) -> Reply:
        """Execute one message."""
        self.messages += 1
        self.status.message = message[:LONGEST].decode("latin-1").strip()
        return super().execute(message)


def run_one(program: Path) -> None:
    """Run one program in this process, with the simulated generator plugged in."""
    named = ADDRESS.search(program.read_text(encoding="utf-8", errors="replace"))
    generator = Overheard(named.group(1) if named else "C010101")
    plug_in(UsbTmcInstrument(generator))
    os.environ["PYVISA_LIBRARY"] = "@py"
    os.environ["MPLBACKEND"] = "Agg"
    sys.path.insert(0, str(program.parent))
    try:
        if program.stem.startswith("test_"):
            import pytest  # noqa: PLC0415 - for files of tests alone

            sys.path.insert(0, str(program.parent.parent))
            pytest.main(
                ["-q", "-p", "no:cacheprovider", "--tb=line", "--rootdir", str(program.parent), str(program)]
            )
        else:
            runpy.run_path(str(program), run_name="__main__")
    finally:
        refused = dict(generator.status.refused)
        unread = list(iter(generator.status.next_error, ErrorCode.NO_ERROR))
        print(f"\n{generator.messages} messages; refused: {refused}; errors that nobody read: {len(unread)}")


def main() -> None:
    """Run each program in a separate process."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("programs", nargs="+", type=Path)
    parser.add_argument("--alone", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    if asked.alone:
        run_one(asked.programs[0])
        return
    for program in asked.programs:
        print(f"== {program}", flush=True)
        subprocess.run(
            [sys.executable, __file__, "--alone", program.absolute()], cwd=program.parent, check=False
        )


if __name__ == "__main__":
    main()
