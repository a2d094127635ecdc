"""The terminal, a viewer and the Run page show bound, target and time left of a recording."""

import io

import pytest
from rich.console import Console

from vibench.acquisition.engine import EngineState, EngineStatus, RunStatus, Supervision
from vibench.acquisition.plan import RunState
from vibench.acquisition.recording import UntilNote
from vibench.cli.engine_bars import engine_bars

UNTIL = UntilNote(
    stretch=1,
    wishes={"response_ii": 0.01},
    bounds={"response_ii": 0.02},
    looked_s=4.0,
    looks=1,
    longest_s=60.0,
)
RUN = RunStatus(
    name="dwell",
    number=1,
    count=1,
    file="dwell.h5",
    run_state=RunState.RECORDING,
    segment="dwell",
    numbers={},
    elapsed_s=6.0,
    total_s=65.0,
    campaign_elapsed_s=6.0,
    campaign_total_s=65.0,
    amplitude_vpp=1.0,
    frequency_hz=200.0,
    until=UNTIL,
)
SAID = "response_ii ± 2 % (goal: 1 %), about 12 s left"


def test_the_terminal_shows_the_bound_and_its_target_and_the_time_left():
    log = io.StringIO()
    status = EngineStatus(state=EngineState.RUNNING, attendance=Supervision.UNATTENDED, run=RUN)
    with engine_bars(Console(file=log, width=300, force_terminal=True)) as bars:
        bars.draw(status)
    assert SAID in log.getvalue()


def test_a_viewer_reads_the_bounds_of_an_engine():
    assert RunStatus.model_validate_json(RUN.model_dump_json()) == RUN
    without = RUN.model_dump(exclude={"until"})
    assert RunStatus.model_validate(without).until is None


def test_the_run_page_shows_bounds_and_targets():
    run_page = pytest.importorskip("vibench.gui.pages.run.run_page", exc_type=ImportError)
    assert run_page._progress_text(RUN).endswith(f"left at most; {SAID}")
