"""The tutorials run unchanged from an empty folder, and their assertions hold."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
TUTORIALS = sorted((ROOT / "docs" / "tutorials").glob("*.md"))
CELL = re.compile(r"^```\{code-cell\} python\n(.*?)^```", flags=re.DOTALL | re.MULTILINE)
SHORT = {"how_accurate"}
"""Tutorials of a few seconds; all others measure on the virtual rig or follow chaos for a long time."""


@pytest.mark.thorough
@pytest.mark.timeout(600)
@pytest.mark.parametrize(
    "tutorial",
    [
        pytest.param(path, id=path.stem, marks=() if path.stem in SHORT else pytest.mark.slow)
        for path in TUTORIALS
    ],
)
def test_a_tutorial_runs_in_an_empty_folder(tutorial, tmp_path):
    cells = CELL.findall(tutorial.read_text(encoding="utf-8"))
    assert len(cells) >= 2
    program = tmp_path / "tutorial.py"
    header = "import matplotlib\nmatplotlib.use('agg')\n"
    program.write_text(header + "\n".join(cells), encoding="utf-8")
    command = [sys.executable, "-W", "error::DeprecationWarning:__main__", str(program)]
    told = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert told.returncode == 0, told.stderr
    assert told.stdout


def test_there_are_eight_tutorials():
    assert len(TUTORIALS) == 8
