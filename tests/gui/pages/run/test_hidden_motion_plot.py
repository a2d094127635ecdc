"""The Run page's plot of the hidden motion estimated by a live twin."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from vibench.acquisition.engine import (
    EngineState,
    EngineStatus,
    RunStatus,
    Supervision,
    TwinStatus,
    TwinSwitch,
)
from vibench.acquisition.plan import RunState
from vibench.analysis.live._view import SweepHistory
from vibench.gui.pages.run.live_plots import HiddenMotionPlot, sweep_history
from vibench.gui.pages.run.run_page import WatchCard

STEP_S, STOPS_M = 1.6e-4, (-44e-6, 46e-6)
P_M = tuple((40e-6 * np.sin(np.arange(300) / 7)).tolist())
FORECAST_M = tuple((40e-6 * np.sin(np.arange(300, 360) / 7)).tolist())
ERROR_M = tuple(np.geomspace(1e-8, 1.05e-5, 60).tolist())


def status(**twin):
    twin = TwinStatus(
        **{
            "state": "tracked",
            "run_id": 1,
            "end_sample": 5120,
            "step_s": STEP_S,
            "p_m": P_M,
            "forecast_m": FORECAST_M,
            "forecast_error_m": ERROR_M,
            "stops_m": STOPS_M,
            "numbers": (("lower gap", "(44.001 ± 0.005) µm"),),
        }
        | twin
    )
    return EngineStatus(state=EngineState.RUNNING, attendance=Supervision.ATTENDED, twin=twin)


@pytest.fixture
def picture(context):
    return HiddenMotionPlot(context.theme)


def is_empty(curve):
    across, _ = curve.getData()
    return across is None or not len(across)


def test_the_live_plot_of_hidden_motion_ends_at_the_newest_sample(picture):
    picture.show_status(status())
    time_s, p = picture.tracked.getData()
    assert time_s[-1] == 0.0
    assert np.diff(time_s) == pytest.approx(np.full(299, STEP_S))
    assert p == pytest.approx(np.array(P_M))
    assert [line.value() for line in picture._stops] == list(STOPS_M)
    assert "tracked · lower gap (44.001 ± 0.005) µm" in picture.caption.text()


def test_the_forecast_fades_as_its_error_grows(picture):
    picture.show_status(status())
    pieces = [np.array(curve.getData()) for curve in picture.forecast]
    assert all(piece.shape[1] for piece in pieces)
    assert pieces[0][0, 0] == pytest.approx(STEP_S)
    for piece, following in pairwise(pieces):
        assert following[0, 0] == piece[0, -1]
    ends = [np.interp(piece[0, -1], STEP_S * np.arange(1, 61), ERROR_M) for piece in pieces]
    assert ends[:-1] == pytest.approx([0.25 * 44e-6 * (n + 1) / 5 for n in range(4)], rel=0.15)


def test_a_lost_track_is_shown_as_a_gap_with_its_reason(picture):
    lost = (*P_M[:100], *[None] * 200)
    picture.show_status(
        status(state="lost", sentence="the motion does not fit", p_m=lost, forecast_m=(), forecast_error_m=())
    )
    assert np.isnan(picture.tracked.getData()[1]).sum() == 200
    assert picture.caption.text().startswith("lost · the motion does not fit")
    assert all(is_empty(curve) for curve in picture.forecast)


def test_the_plot_of_hidden_motion_is_empty_without_a_twin(picture):
    picture.show_status(status())
    picture.show_status(EngineStatus(state=EngineState.RUNNING, attendance=Supervision.ATTENDED))
    assert is_empty(picture.tracked)
    assert picture.caption.text() == "The live twin is off."


def test_the_twin_switch_shows_and_changes_the_state_of_the_twin(context, qtbot):
    card = WatchCard(context.theme)
    card.show_status(status(), 0)
    assert card.twin.isChecked()
    assert not card.twin.isEnabled()
    card.twin.setEnabled(True)
    with qtbot.waitSignal(card.twin_requested) as asked:
        card.twin.click()
    assert asked.args == [TwinSwitch.OFF]


def test_averages_are_counted_and_the_current_average_can_be_rejected(context, qtbot):
    card = WatchCard(context.theme)
    playing = RunStatus(
        name="noise", number=1, count=1, file="noise.h5", run_state=RunState.RECORDING, segment="realisation",
        numbers={"realisation": 3}, elapsed_s=20.0, total_s=60.0, campaign_elapsed_s=20.0,
        campaign_total_s=60.0, amplitude_vpp=0.2, frequency_hz=None,
    )  # fmt: skip
    running = EngineStatus(state=EngineState.RUNNING, attendance=Supervision.ATTENDED, run=playing)
    card.show_status(running, 10)
    assert card.averages.text() == "4 of 10"
    with qtbot.waitSignal(card.reject_requested):
        card.reject_button.click()
    card.show_status(running.model_copy(update={"state": EngineState.READY}), 10)
    assert card.averages.text() == "–"
    assert not card.reject_button.isEnabled()


def test_response_ii_is_drawn_beside_its_prediction(context):
    plot = sweep_history(context.theme)
    assert set(plot.measured) <= set(plot.predicted)


def test_a_live_history_that_is_full_still_shows_new_points(context):
    plot = sweep_history(context.theme)
    rows = np.arange(7 * 50.0).reshape(7, 50) + 1.0
    for columns in (rows[:, :40], rows[:, 10:]):
        plot.show_view(SimpleNamespace(history=lambda columns=columns: SweepHistory(*columns)))
    assert plot.measured["response_i"].getData()[0] == pytest.approx(rows[1, 10:])
