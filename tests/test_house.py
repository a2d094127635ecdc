"""The house rules, checked as tests so that one command is the whole check."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
TOOLS = Path(sys.executable).parent


@pytest.mark.parametrize(
    "command",
    [
        pytest.param(["ruff", "check", "."], id="lint"),
        pytest.param(["ruff", "format", "--check", "."], id="format"),
        pytest.param(["mypy"], id="types"),
        pytest.param(["lint-imports", "--no-cache"], id="imports-point-one-way"),
    ],
)
def test_the_house_rules_hold(command):
    result = subprocess.run(
        [str(TOOLS / command[0]), *command[1:]], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, f"{' '.join(command)}\n{result.stdout}{result.stderr}"


def test_the_five_packages_lie_in_one_folder():
    import acquisition
    import analysis
    import cli
    import gui
    import sim

    homes = {Path(package.__file__).parent.parent for package in (cli, gui, analysis, acquisition, sim)}
    assert len(homes) == 1
