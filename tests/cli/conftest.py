"""Run the command line in separate processes, or in this process where that makes no difference."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import chdir, redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import pytest

from vibench.cli import main
from vibench.cli.output import console

ROOT = Path(__file__).resolve().parents[2]
OWN = {"PYTHONPATH": str(ROOT), "COLUMNS": "200"}
ENVIRONMENT = {**os.environ, **OWN}
Vibench = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture
def own_state(tmp_path_factory, monkeypatch):
    """Use a temporary state folder, so that only programs of the test are found."""
    monkeypatch.setenv("VIBENCH_STATE_DIR", str(tmp_path_factory.mktemp("state")))


@pytest.fixture(scope="session")
def vibench() -> Vibench:
    """Return a function that runs ``vibench`` in a folder, in a new process."""

    def run(*arguments, cwd, timeout_s=110, environment=None):
        return subprocess.run(
            [sys.executable, "-m", "vibench.cli", *map(str, arguments)],
            cwd=cwd,
            env={**os.environ, **OWN, **(environment or {})},
            capture_output=True,
            text=True,
            check=False,
            timeout=timeout_s,
        )

    return run


@pytest.fixture(scope="session")
def vibench_here() -> Vibench:
    """Return a function that runs ``vibench`` in this process, without the seconds that imports take."""

    def run(*arguments, cwd, environment=None):
        words = ["vibench", *map(str, arguments)]
        out, err = StringIO(), StringIO()
        with pytest.MonkeyPatch.context() as patch, chdir(cwd), redirect_stdout(out), redirect_stderr(err):
            patch.setattr(sys, "argv", words)
            for name, value in {"COLUMNS": "200", **(environment or {})}.items():
                patch.setenv(name, value)
            # A command with --json sets the console to standard error for its whole process.
            patch.setattr(console, "stderr", False)
            with pytest.raises(SystemExit) as ended:
                main()
        return subprocess.CompletedProcess(words, ended.value.code or 0, out.getvalue(), err.getvalue())

    return run


@pytest.fixture
def output_of(vibench_here, tmp_path):
    """Run a command that must succeed in the test's folder; return its JSON, or its standard output."""

    def run(*arguments):
        ran = vibench_here(*arguments, cwd=tmp_path)
        assert ran.returncode == 0, ran.stderr
        return json.loads(ran.stdout) if "--json" in arguments else ran.stdout

    return run


@pytest.fixture
def refusal(vibench_here, tmp_path):
    """Run a command that must be refused in the test's folder; return its one sentence."""

    def run(*arguments):
        ran = vibench_here(*arguments, cwd=tmp_path)
        assert ran.returncode == 1
        # `measure` first prints the duration of the campaign.
        assert ran.stdout == "" or (arguments[0] == "measure" and "--estimate" not in arguments)
        assert "Traceback" not in ran.stderr
        (sentence,) = [line for line in ran.stderr.splitlines() if line.startswith("error: ")]
        return sentence

    return run
