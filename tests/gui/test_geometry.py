"""No text, font or scale takes STOP, the state or the status line away, or any button out of reach."""

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
    # What a screen of 1920 x 1080, or of 2560 x 1440, leaves to a window.
    "1.5": ((1920, 1080, 8), (1280, 720, 14), (2560, 1440, 18), (1706, 960, 10)),
    "2": ((1920, 1080, 18), (960, 540, 8), (960, 540, 14), (1280, 720, 10), (2560, 1440, 8)),
}
"""By scale: width and height in pixels of the layout, and height of the letters in points; pairwise."""


@pytest.mark.thorough
@pytest.mark.parametrize("scale", CASES)
def test_every_page_is_usable_at_every_size_font_and_scale(scale, tmp_path):
    """A process for each scale: Qt takes it once."""
    environment = {**os.environ, "QT_SCALE_FACTOR": scale, "QT_QPA_PLATFORM": "offscreen"}
    environment["VIBENCH_STATE_DIR"] = str(tmp_path)
    asked = [sys.executable, "-m", "tests.gui.geometry", json.dumps(CASES[scale])]
    told = subprocess.run(asked, env=environment, capture_output=True, text=True, check=False, timeout=280)
    assert told.returncode == 0, told.stderr
    assert json.loads(told.stdout) == []
