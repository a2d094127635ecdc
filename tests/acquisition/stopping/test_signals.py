"""Whatever the system ends a program by is a stop, as far as it can be heeded."""

import signal

import pytest

from vibench.acquisition import StopSwitch, stop_on_signal
from vibench.acquisition.stopping._stop_on_signal import CAUSES


@pytest.mark.parametrize("name", [each for each in CAUSES if each in signal.Signals.__members__])
def test_every_signal_that_would_end_the_program_is_a_stop(name, tmp_path, monkeypatch):
    monkeypatch.setenv("VIBENCH_STATE_DIR", str(tmp_path))
    switch = StopSwitch()
    with stop_on_signal(switch, "dwell"):
        signal.raise_signal(signal.Signals[name])
    assert switch.request.cause is CAUSES[name]
