"""Rows of a campaign say what is held where something is held."""

from pathlib import Path

from vibench.acquisition import load_campaign
from vibench.gui.pages.queue._row_words import entry_rows

CAMPAIGNS = Path(__file__).resolve().parents[4] / "campaigns"


def test_a_row_names_the_level_of_the_base_and_a_sweep_its_kind():
    what = {name: said for name, said, *_ in entry_rows(load_campaign(CAMPAIGNS / "smart.toml"))}
    assert what["dwell_260"] == "held dwell, base held at 5 µm, at most 1 Vpp"
    assert what["mode_1"] == "resonance tracking, base held at 0.05 m/s², 0.1 m/s², at most 0.05 Vpp"
    what = {name: said for name, said, *_ in entry_rows(load_campaign(CAMPAIGNS / "quick.toml"))}
    assert (what["sweep"], what["branch"]) == ("sine sweep, 1.5 Vpp", "sweep of dwell")
