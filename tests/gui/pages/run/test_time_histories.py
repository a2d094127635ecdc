"""Time histories are labelled with channel and unit, also after the channels change."""

import numpy as np
import pytest

from vibench.analysis.live import LiveChannel, LiveView
from vibench.gui.pages.run.live_plots import TimeHistoryPlots, channel_axis
from vibench.gui.widgets.theme import LIGHT

FOUR = (
    ("drive_voltage", "V"),
    ("amplifier_voltage", "V"),
    ("base_acceleration", "m/s²"),
    ("m0_velocity", "m/s"),
)
RATE_HZ = 51_200.0
OTHERS = (("base_acceleration", "m/s²"), ("m0_velocity", "V"))


@pytest.fixture
def time_histories(qapp, closing):
    made = closing(TimeHistoryPlots(LIGHT))
    made.resize(1000, 700)
    made.show()
    return made


@pytest.mark.parametrize("channels", [(FOUR,), (FOUR, OTHERS), (OTHERS, FOUR)])
def test_each_time_history_is_labelled_with_its_channel(time_histories, qapp, channels):
    for shown in channels:
        time_histories.show_channels(shown)
        qapp.processEvents()
    wanted = [channel_axis(*channel).text for channel in channels[-1]]
    assert [plot.up.labelText for plot in time_histories.plots] == wanted
    assert all(plot.up.label.isVisible() for plot in time_histories.plots)


def test_only_the_last_time_history_has_a_time_axis(time_histories, qapp):
    for channels in (OTHERS, FOUR, OTHERS):
        time_histories.show_channels(channels)
        qapp.processEvents()
        labelled = [plot.across.label.isVisible() for plot in time_histories.plots]
        assert labelled == [False] * (len(channels) - 1) + [True]


@pytest.mark.parametrize("width", [833, 872, 905])
def test_the_envelope_of_a_growing_sine_is_drawn_without_gaps(time_histories, qapp, width):
    """Rounding left every second pixel column empty at a width of 1280."""
    time_s = np.arange(round(2.0 * RATE_HZ)) / RATE_HZ
    phase = 2 * np.pi * (290.0 + 6.75 * time_s) * time_s
    sine = ((0.55 + 0.035 * time_s) * np.sin(phase)).astype(np.float32)
    view = LiveView([LiveChannel("drive_voltage", "V", 1.0, 10.0)], RATE_HZ, band_hz=(150.0, 350.0))
    view.add(0, sine[np.newaxis])
    time_histories.show_channels((("drive_voltage", "V"),))
    time_histories.resize(width, 200)
    qapp.processEvents()
    time_histories.show_view(view, 2.0)
    qapp.processEvents()
    (plot,) = time_histories.plots
    picture = plot.grab().toImage()
    box = plot.mapFromScene(plot.getViewBox().sceneBoundingRect()).boundingRect()
    # The grid is grey and drawn over the signal.
    tops = [
        next(y for y in range(box.top(), box.bottom()) if picture.pixelColor(x, y).saturation() > 100)
        for x in range(box.left() + 5, box.right() - 5)
    ]
    assert tops[0] > tops[-1]
    assert np.all(np.diff(tops) <= 0)
