"""Without a display one sentence gives the reason and what to install, instead of Qt's messages."""

import os
import subprocess
import sys

import pytest

from vibench.gui import __main__ as display


def start_window(tmp_path, **environment):
    own = {"PATH": os.environ["PATH"], "HOME": str(tmp_path), "PYTHONPATH": os.environ.get("PYTHONPATH", "")}
    command = [sys.executable, "-m", "vibench.gui", "--settings", str(tmp_path / "window.ini")]
    return subprocess.run(
        command, env={**own, **environment}, capture_output=True, text=True, check=False, timeout=100
    )


@pytest.mark.skipif(sys.platform != "linux", reason="other systems always have a display")
@pytest.mark.parametrize("given", [{}, {"DISPLAY": ":97"}], ids=["none", "dead"])
def test_a_missing_display_is_reported_in_one_sentence(tmp_path, given):
    result = start_window(tmp_path, **given)
    assert result.returncode == 1
    assert result.stderr.startswith("The window cannot be opened: ")
    assert len(result.stderr.splitlines()) == 1
    assert "display" in result.stderr or "apt-get install" in result.stderr
    assert "qt.qpa" not in result.stderr


def test_missing_libraries_are_reported_with_the_packages_to_install(monkeypatch):
    def refuse(path):
        raise OSError("libxcb-cursor.so.0: cannot open shared object file: No such file or directory")

    monkeypatch.setattr(display.ctypes, "CDLL", refuse)
    said = display._plugin_trouble()
    assert "libxcb-cursor0 is missing" in said
    assert "apt-get install" in said
    assert "libxkbcommon-x11-0" in said


def test_a_qt_library_that_cannot_be_loaded_is_reported_in_one_sentence(tmp_path):
    """As on a machine without the libraries that Qt links to."""
    package = tmp_path / "PySide6"
    package.mkdir()
    missing = "libglib-2.0.so.0: cannot open shared object file"
    (package / "__init__.py").write_text(f'raise ImportError("{missing}")\n')
    result = start_window(tmp_path, PYTHONPATH=str(tmp_path), QT_QPA_PLATFORM="offscreen")
    assert result.returncode == 1
    assert result.stderr.startswith(
        f"The window cannot be opened: Qt cannot be loaded ({missing}); on Debian: "
    )
    assert len(result.stderr.splitlines()) == 1
