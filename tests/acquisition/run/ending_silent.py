"""Functions for tests of runs: reach a state, cause a fault, and look at the output and the recording."""

import re

import numpy as np

from vibench.acquisition import open_bench, open_recording
from vibench.acquisition.plan import RunState
from vibench.acquisition.rig import CalibrationRule, confirm_simulated


def bench_on(connected):
    return open_bench(connected, confirm_simulated, CalibrationRule.WAIVED)


def upto(run, state):
    """Iterate until the run yields a block in ``state``."""
    return next(progress for progress in run if progress.state is state)


def when_recording(act):
    """Return a progress callback that calls ``act`` once, at the first recorded block."""
    done = []

    def watch(progress):
        if progress.state is RunState.RECORDING and not done:
            done.append(True)
            act()

    return watch


def terminal_v(virtual, duration_s=0.1):
    """Return the largest voltage at the generator's terminal during the next ``duration_s``."""
    start_s, interval_s = virtual.world.time_s, 1e-4
    virtual.world.advance(duration_s)
    count = round(duration_s / interval_s)
    return np.max(np.abs(virtual.generator.render(start_s + duration_s, interval_s, count)))


def kept_drive(path, state, reason):
    """Return the drive voltage of a recording, which must have this state and reason."""
    with open_recording(path) as recording:
        assert recording.state is state
        assert re.search(reason, recording.reason, re.IGNORECASE), recording.reason
        drive = recording.read("drive_voltage")
    assert np.max(np.abs(drive)) > 0
    return drive
