"""The robot finds results of other inputs, errors of other processes, and exceptions in slots."""

import subprocess
import sys
from collections import deque
from types import SimpleNamespace

import pytest

QtWidgets = pytest.importorskip("PySide6.QtWidgets", exc_type=ImportError)


@pytest.fixture
def robot(qtbot):
    from vibench.gui.page.page import DisplayedResult

    from .robot import Robot

    label = QtWidgets.QLabel("24 of 60 m/s²")
    qtbot.addWidget(label)
    made = object.__new__(Robot)
    made.findings, made.recent = [], deque(["type_value"])
    shown = DisplayedResult(lambda: "amplitude 1", label)
    shown.show("amplitude 2")
    made.page = SimpleNamespace(displayed_results=(shown,))
    made.window = SimpleNamespace(pages={"Test": made.page})
    made.label = label
    return made


def test_the_robot_finds_numbers_that_do_not_match_the_inputs(robot):
    robot.look()
    assert robot.findings == []
    robot.label.setEnabled(True)
    robot.look()
    robot.look()
    (found,) = robot.findings
    assert "amplitude 2" in found
    assert "amplitude 1" in found
    assert "type_value" in found


def test_the_robot_finds_unexpected_errors_in_another_process(robot, tmp_path):
    with (tmp_path / "stderr").open("w+") as told, (tmp_path / "stderr").open() as robot.errors:
        subprocess.run([sys.executable, "-c", "print(0)"], stderr=told, stdout=told, check=True)
        robot.read_errors()
        assert robot.findings == []
        subprocess.run([sys.executable, "-c", "None.nothing"], stderr=told, check=False)
        robot.read_errors()
    assert "no attribute 'nothing'" in robot.findings[0]


def test_the_robot_reports_an_exception_with_its_source_file(robot):
    try:
        robot.nothing  # noqa: B018
    except AttributeError as error:
        robot._on_exception(AttributeError, error, error.__traceback__)
    assert "test_harness.py" in robot.findings[0]
