"""STOP, state, status line and all buttons stay reachable with any text, font and scale."""

import json
import os
import subprocess
import sys

import pytest

CASES = {
    "1": (
        (1024, 700, 8),
        (1024, 700, 14),
        (1280, 800, 10),
        (1280, 800, 18),
        (1920, 1080, 14),
        (2560, 1440, 18),
    ),
    # Space for a window on a screen of 1920 x 1080 or 2560 x 1440.
    "1.5": ((1920, 1080, 8), (1280, 720, 14), (2560, 1440, 18), (1706, 960, 10)),
    "2": ((1920, 1080, 18), (960, 540, 8), (960, 540, 14), (1280, 720, 10), (2560, 1440, 8)),
}
"""For each scale: width and height in logical pixels and font size in points."""


@pytest.mark.thorough
@pytest.mark.parametrize("scale", CASES)
def test_every_page_is_usable_at_every_size_font_and_scale(scale, tmp_path):
    """Qt reads the scale once, so each scale has a process."""
    environment = {**os.environ, "QT_SCALE_FACTOR": scale, "QT_QPA_PLATFORM": "offscreen"}
    environment["VIBENCH_STATE_DIR"] = str(tmp_path)
    command = [sys.executable, "-m", "tests.gui.geometry", json.dumps(CASES[scale])]
    result = subprocess.run(
        command, env=environment, capture_output=True, text=True, check=False, timeout=280
    )
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout) == []
