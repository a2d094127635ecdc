"""The folder for state on each operating system, and the environment variable that changes it."""

import os
import sys
from pathlib import Path

import pytest

from tests.windows_here import windows
from vibench.sim.operating_system import this as _state_folder
from vibench.sim.operating_system.this import state_folder


def test_the_environment_variable_for_the_state_folder_takes_precedence(monkeypatch, tmp_path):
    monkeypatch.setenv("VIBENCH_STATE_DIR", str(tmp_path))
    assert state_folder() == tmp_path


@pytest.mark.parametrize(
    ("platform", "variable", "expected"),
    [
        ("linux", "XDG_STATE_HOME", "given/vibench"),
        ("linux", "", "home/.local/state/vibench"),
        ("darwin", "", "home/Library/Application Support/vibench"),
        ("win32", "LOCALAPPDATA", "given/vibench"),
        ("win32", "", "home/AppData/Local/vibench"),
    ],
)
def test_each_platform_uses_its_standard_state_folder(monkeypatch, tmp_path, platform, variable, expected):
    if platform == "win32":
        monkeypatch.setattr(_state_folder, "usual_state_folder", windows().usual_state_folder)
    elif not hasattr(os, "fork"):
        pytest.skip("Windows has not the functions of the other systems")
    monkeypatch.setattr(sys, "platform", platform)
    for each in ("VIBENCH_STATE_DIR", "XDG_STATE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(each, raising=False)
    monkeypatch.setattr(Path, "home", lambda: tmp_path / "home")
    if variable:
        monkeypatch.setenv(variable, str(tmp_path / "given"))
    assert state_folder() == tmp_path / expected
    assert (tmp_path / expected).is_dir()
