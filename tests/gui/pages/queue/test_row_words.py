"""Rows of a campaign show held base levels and states."""

from dataclasses import replace
from pathlib import Path

import pytest

from vibench.acquisition import load_campaign
from vibench.acquisition.engine import EngineState, RowStatus
from vibench.gui.pages.queue.draft import entry_rows, point_rows, preview_campaign

CAMPAIGNS = Path(__file__).resolve().parents[4] / "campaigns"


def test_campaign_rows_show_the_base_level_and_the_kind_of_sweep():
    what = {name: said for name, said, *_ in entry_rows(load_campaign(CAMPAIGNS / "smart.toml"))}
    assert what["dwell_260"] == "held dwell, base held at 5 µm, at most 1 Vpp"
    assert what["mode_1"] == "resonance tracking, base held at 0.05 m/s², 0.1 m/s², at most 0.05 Vpp"
    what = {name: said for name, said, *_ in entry_rows(load_campaign(CAMPAIGNS / "quick.toml"))}
    assert (what["sweep"], what["branch"]) == ("sine sweep, 1.5 Vpp", "sweep of dwell")


def test_campaign_rows_count_the_recordings_at_all_points_of_a_scan():
    (row,) = entry_rows(load_campaign(CAMPAIGNS / "scan.toml"))
    assert row[:1] + row[2:3] == ("noise", "4")


def test_campaign_rows_show_levels_and_existing_recordings(tmp_path):
    """After a restart of the window all rows were shown as planned."""
    campaign = load_campaign(CAMPAIGNS / "quick.toml")
    seen = replace(preview_campaign((campaign, None, tmp_path)), complete=frozenset({"dwell"}))
    rows = {name: (sign, level, said) for sign, name, level, said in point_rows(seen, (), EngineState.READY)}
    assert set(rows) == set(campaign.recording_names())
    assert rows["sweep"] == ("○", "1.5 Vpp", "planned")
    assert all(level.endswith("Vpp") for _, level, _ in rows.values())
    done = [said for name, (_, _, said) in rows.items() if name == "dwell"]
    assert done in ([], ["recorded before"])
    whole = replace(seen, complete=frozenset(rows))
    assert {said for *_, said in point_rows(whole, (), EngineState.CLOSED)} == {"recorded before"}


@pytest.mark.parametrize(
    ("state", "reason", "said"),
    [
        ("stopped", "stopped by the operator, in the window", "stopped by the operator, in the window"),
        ("failed", "the laser was lost", "failed: the laser was lost"),
        ("queued", "", "queued"),
    ],
)
def test_a_campaign_row_shows_its_state_once(state, reason, said):
    row = RowStatus(name="dwell", state=state, reason=reason, file="")
    assert point_rows(None, (row,), EngineState.RUNNING)[0][3] == said
