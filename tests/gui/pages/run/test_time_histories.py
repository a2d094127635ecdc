"""The lanes of a run say which channel they show, in its unit, also when the channels change."""

import pytest

from vibench.gui.pages.run._time_histories import TimeHistoryPlots, channel_axis
from vibench.gui.widgets import LIGHT

FOUR = (
    ("drive_voltage", "V"),
    ("amplifier_voltage", "V"),
    ("base_acceleration", "m/s²"),
    ("m0_velocity", "m/s"),
)
OTHERS = (("base_acceleration", "m/s²"), ("m0_velocity", "V"))


@pytest.fixture
def time_histories(qapp, qtbot):
    made = TimeHistoryPlots(LIGHT)
    qtbot.addWidget(made)
    made.resize(1000, 700)
    made.show()
    return made


@pytest.mark.parametrize("channels", [(FOUR,), (FOUR, OTHERS), (OTHERS, FOUR)])
def test_each_lane_is_labelled_with_its_channel(time_histories, qapp, channels):
    for shown in channels:
        time_histories.show_channels(shown)
        qapp.processEvents()
    wanted = [channel_axis(*channel).text for channel in channels[-1]]
    assert [plot.up.labelText for plot in time_histories.plots] == wanted
    assert all(plot.up.label.isVisible() for plot in time_histories.plots)


def test_the_last_lane_alone_has_the_time(time_histories, qapp):
    for channels in (OTHERS, FOUR, OTHERS):
        time_histories.show_channels(channels)
        qapp.processEvents()
        labelled = [plot.across.label.isVisible() for plot in time_histories.plots]
        assert labelled == [False] * (len(channels) - 1) + [True]
