"""The command line in processes of its own."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "200"}
Vibench = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="session")
def vibench() -> Vibench:
    """Run ``vibench`` with arguments in a folder, and wait for its end."""

    def run(*arguments, cwd, timeout_s=110, environment=None):
        return subprocess.run(
            [sys.executable, "-m", "cli", *map(str, arguments)],
            cwd=cwd,
            env={**ENVIRONMENT, **(environment or {})},
            capture_output=True,
            text=True,
            check=False,
            timeout=timeout_s,
        )

    return run
