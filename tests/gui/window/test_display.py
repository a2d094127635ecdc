"""Where no window can be shown, one sentence says why and what to install; Qt's own words never come up."""

import os
import subprocess
import sys

import pytest

from vibench.gui.window import open_window as _display


def started(tmp_path, **environment):
    own = {"PATH": os.environ["PATH"], "HOME": str(tmp_path), "PYTHONPATH": os.environ.get("PYTHONPATH", "")}
    asked = [sys.executable, "-m", "vibench.gui", "--settings", str(tmp_path / "window.ini")]
    return subprocess.run(
        asked, env={**own, **environment}, capture_output=True, text=True, check=False, timeout=100
    )


@pytest.mark.skipif(sys.platform != "linux", reason="other systems always have a display")
@pytest.mark.parametrize("display", [{}, {"DISPLAY": ":97"}], ids=["none", "dead"])
def test_a_missing_display_is_reported_in_one_sentence(tmp_path, display):
    told = started(tmp_path, **display)
    assert told.returncode == 1
    assert told.stderr.startswith("The window cannot be opened: ")
    assert len(told.stderr.splitlines()) == 1
    assert "display" in told.stderr or "apt-get install" in told.stderr
    assert "qt.qpa" not in told.stderr


def test_missing_libraries_are_reported_with_the_packages_to_install(monkeypatch):
    def refused(path):
        raise OSError("libxcb-cursor.so.0: cannot open shared object file: No such file or directory")

    monkeypatch.setattr(_display.ctypes, "CDLL", refused)
    said = _display._plugin_trouble()
    assert "libxcb-cursor0 is missing" in said
    assert "apt-get install" in said
    assert "libxkbcommon-x11-0" in said
