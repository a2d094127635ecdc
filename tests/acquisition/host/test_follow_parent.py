"""Workers of a program that was killed do not stay behind."""

import subprocess
import sys

import pytest

PROGRAM = """
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from vibench.acquisition import follow_parent
import os, signal

if __name__ == "__main__":
    pool = ProcessPoolExecutor(2, mp_context=get_context("spawn"), initializer=follow_parent)
    print(pool.submit(os.getpid).result() != os.getpid(), flush=True)
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGKILL")
def test_workers_end_when_their_program_is_killed(tmp_path):
    script = tmp_path / "program.py"
    script.write_text(PROGRAM)
    with subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True) as killed:
        # The end comes when nobody holds the other side of the pipe any more, no worker either.
        assert killed.stdout.read() == "True\n"
