"""Fixtures of the tests of acquisition, and an environment without extensions."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.acquisition.conftest import no_drive_left_on, rig

__all__ = ["no_drive_left_on", "rig"]

ROOT = Path(__file__).resolve().parents[2]
PORTIONS = ("acquisition", "analysis", "cli", "gui", "sim", "virtual_rig")


@pytest.fixture(scope="session")
def path_without_extensions(tmp_path_factory):
    """Return a module search path with all installed packages except the extensions of vibench."""
    folder = tmp_path_factory.mktemp("packages")
    for path in Path(pytest.__file__).parents[1].iterdir():
        if not path.name.startswith(("vibench_", "_vibench")):
            (folder / path.name).symlink_to(path)
    return os.pathsep.join(map(str, (*(ROOT / each for each in PORTIONS), folder)))


@pytest.fixture
def run(path_without_extensions, tmp_path):
    """Return a function that runs Python without the extensions of vibench, in a temporary folder."""

    def run(*arguments):
        return subprocess.run(
            [sys.executable, "-S", *map(str, arguments)],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": path_without_extensions},
            capture_output=True,
            text=True,
            check=False,
        )

    return run
