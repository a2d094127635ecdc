"""Every signal that would end or suspend a program requests a stop, if it can be caught."""

import signal
import subprocess
import sys

import pytest

from vibench.acquisition import StopSwitch, stop_on_signal
from vibench.acquisition.stopping.program import LEFT_TO_THE_DEAD_MAN, signal_name, stop_signals
from vibench.acquisition.stopping.stop import Cause

VALID = sorted(getattr(signal, "valid_signals", set)())
UNHEEDED = """
import signal
signal.signal(signal.SIGINT, signal.SIG_DFL)
signal.raise_signal({number})
print("lives")
"""


@pytest.fixture
def default_handlers():
    """Restore Python's default handlers, since pytest replaces some."""
    before = {number: signal.getsignal(number) for number in VALID if signal_name(number) not in UNCATCHABLE}
    python = {"SIGINT": signal.default_int_handler, "SIGPIPE": signal.SIG_IGN, "SIGXFSZ": signal.SIG_IGN}
    for number in before:
        signal.signal(number, python.get(signal_name(number), signal.SIG_DFL))
    yield
    for number, handler in before.items():
        if handler is not None:
            signal.signal(number, handler)


UNCATCHABLE = ("SIGKILL", "SIGSTOP")


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
@pytest.mark.parametrize("number", VALID, ids=signal_name)
def test_signals_that_end_or_suspend_a_program_abort_its_run(number, default_handlers, tmp_path, monkeypatch):
    if signal_name(number) in LEFT_TO_THE_DEAD_MAN:
        assert number not in stop_signals()
        return
    monkeypatch.setenv("VIBENCH_STATE_DIR", str(tmp_path))
    switch = StopSwitch()
    with stop_on_signal(switch, "dwell"):
        signal.raise_signal(number)
    if switch.request is None:
        assert survives(number), f"{signal_name(number)} ends or stops a process, and was not heeded"
    else:
        is_ctrl_c = number == signal.SIGINT
        assert switch.request.cause is (Cause.KEYBOARD if is_ctrl_c else Cause.TERMINATED)


def survives(number):
    """Return whether a Python program continues after a signal that it does not handle."""
    told = subprocess.run(
        [sys.executable, "-c", UNHEEDED.format(number=number)], capture_output=True, text=True, check=False
    )
    return told.stdout == "lives\n"


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
def test_a_second_ctrl_z_does_not_stop_a_run_faster(default_handlers, tmp_path, monkeypatch):
    monkeypatch.setenv("VIBENCH_STATE_DIR", str(tmp_path))
    switch = StopSwitch()
    with stop_on_signal(switch, "dwell"):
        signal.raise_signal(signal.SIGTSTP)
        signal.raise_signal(signal.SIGTSTP)
    assert switch.request.reason.startswith("SIGTSTP")
    assert signal.getsignal(signal.SIGTSTP) is signal.SIG_DFL


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
def test_a_signal_stops_the_innermost_of_two_nested_runs(default_handlers, tmp_path, monkeypatch):
    monkeypatch.setenv("VIBENCH_STATE_DIR", str(tmp_path))
    outer, inner = StopSwitch(), StopSwitch()
    with stop_on_signal(outer, "campaign"), stop_on_signal(inner, "dwell"):
        signal.raise_signal(signal.SIGUSR1)
    assert (outer.request, inner.request.cause) == (None, Cause.TERMINATED)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signals")
def test_signals_handled_by_the_program_are_not_taken_over(default_handlers, tmp_path, monkeypatch):
    monkeypatch.setenv("VIBENCH_STATE_DIR", str(tmp_path))
    taken, switch = [], StopSwitch()
    signal.signal(signal.SIGUSR2, lambda number, frame: taken.append(number))
    with stop_on_signal(switch, "dwell"):
        signal.raise_signal(signal.SIGUSR2)
    assert (taken, switch.request) == ([signal.SIGUSR2], None)
