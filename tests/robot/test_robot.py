"""One minute of reproducible random actions; longer runs: ``python -m tests.robot``."""

import subprocess
import sys

import pytest

pytest.importorskip("PySide6.QtWidgets", exc_type=ImportError)

pytestmark = [pytest.mark.attack, pytest.mark.timeout(900)]


def test_one_minute_of_random_actions_in_the_window_finds_no_fault():
    asked = [sys.executable, "-m", "tests.robot", "--seed", "19", "--minutes", "1"]
    told = subprocess.run(asked, capture_output=True, text=True, check=False, timeout=850)
    assert told.returncode == 0, told.stdout + told.stderr
