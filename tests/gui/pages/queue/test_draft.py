"""A campaign is edited entry by entry and is valid after every step."""

import pytest

from vibench.acquisition import ConfigurationError, load_campaign, save_toml, shipped
from vibench.acquisition.plan import Measurement, Range, SweepAxis
from vibench.acquisition.rig import load_rig
from vibench.gui.pages.queue.draft import move_up, remove_entry, with_measurement, with_sweep

DWELL = Measurement.model_validate(
    {
        "name": "dwell",
        "excitation": {"kind": "dwell", "amplitude_vpp": 1.5, "frequency_hz": 260, "duration_s": 2},
    }
)
RIG = load_rig(shipped("hardware_configs/virtual_rig.toml"))
LEVELS = Range(start=0.5, stop=2.5, count=5)


def names(campaign):
    return campaign.recording_names()


def test_a_test_that_is_added_twice_gets_two_names():
    campaign = with_measurement(with_measurement(None, DWELL), DWELL)
    assert names(campaign) == ("dwell", "dwell-2")


def test_a_level_sweep_makes_one_recording_per_level():
    campaign = with_sweep(with_measurement(None, DWELL), DWELL, SweepAxis.LEVEL, LEVELS, RIG)
    levels = [each.excitation.amplitude_vpp for _, each in campaign.recordings()]
    assert levels == [1.5, 0.5, 1.0, 1.5, 2.0, 2.5]


def test_a_sweep_beyond_the_range_of_the_generator_is_refused():
    with pytest.raises(ConfigurationError, match=r"amplitude_vpp"):
        with_sweep(None, DWELL, SweepAxis.LEVEL, Range(start=1, stop=100, count=2), RIG)


def test_entries_of_a_campaign_can_be_moved_and_removed():
    other = DWELL.model_copy(update={"name": "other"})
    campaign = with_measurement(with_measurement(None, DWELL), other)
    assert names(move_up(campaign, 1)) == ("other", "dwell")
    assert names(remove_entry(campaign, 0)) == ("other",)
    assert remove_entry(remove_entry(campaign, 0), 0) is None


def test_a_saved_campaign_loads_unchanged(tmp_path):
    campaign = with_sweep(
        with_measurement(None, DWELL), DWELL, SweepAxis.FREQUENCY, Range(start=200, stop=300, step=50), None
    )
    save_toml(campaign, tmp_path / "sub" / "queue.toml")
    assert load_campaign(tmp_path / "sub" / "queue.toml") == campaign
