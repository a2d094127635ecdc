"""Without a display one sentence gives the reason and what to install, instead of Qt's messages."""

import os
import subprocess
import sys

import pytest

from vibench.gui.window import open_window as _display


def started(tmp_path, **environment):
    own = {"PATH": os.environ["PATH"], "HOME": str(tmp_path), "PYTHONPATH": os.environ.get("PYTHONPATH", "")}
    command = [sys.executable, "-m", "vibench.gui", "--settings", str(tmp_path / "window.ini")]
    return subprocess.run(
        command, env={**own, **environment}, capture_output=True, text=True, check=False, timeout=100
    )


@pytest.mark.skipif(sys.platform != "linux", reason="other systems always have a display")
@pytest.mark.parametrize("display", [{}, {"DISPLAY": ":97"}], ids=["none", "dead"])
def test_a_missing_display_is_reported_in_one_sentence(tmp_path, display):
    result = started(tmp_path, **display)
    assert result.returncode == 1
    assert result.stderr.startswith("The window cannot be opened: ")
    assert len(result.stderr.splitlines()) == 1
    assert "display" in result.stderr or "apt-get install" in result.stderr
    assert "qt.qpa" not in result.stderr


def test_missing_libraries_are_reported_with_the_packages_to_install(monkeypatch):
    def refused(path):
        raise OSError("libxcb-cursor.so.0: cannot open shared object file: No such file or directory")

    monkeypatch.setattr(_display.ctypes, "CDLL", refused)
    said = _display._plugin_trouble()
    assert "libxcb-cursor0 is missing" in said
    assert "apt-get install" in said
    assert "libxkbcommon-x11-0" in said
