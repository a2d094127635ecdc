"""A line has the same width at high and low screen resolution."""

import os
import subprocess
import sys

import pytest

WIDTHS = """
from vibench.gui.window.window import application
application([])
from vibench.gui.plots.axis import TIME, PlotAxis
from vibench.gui.plots.line_style import LineStyle
from vibench.gui.plots.plot import Plot
from vibench.gui.widgets.theme import LIGHT
plot = Plot("a plot", TIME, PlotAxis("Height", "m"), LIGHT)
plot.resize(400, 300)
plot.setXRange(0, 10, padding=0)
plot.setYRange(0, 10, padding=0)
line = plot.curve(LineStyle(lambda theme: "#ff0000"))
for x, y in (([0.0, 10.0], [4.3, 4.3]), ([4.3, 4.3], [0.0, 10.0])):
    line.setData(x, y)
    picture = plot.grab().toImage()
    across, down = picture.width() * 3 // 4, picture.height() // 4
    places = [(across, each) for each in range(picture.height())] if y[0] == y[1] else (
        [(each, down) for each in range(picture.width())])
    print(sum(picture.pixelColor(*place).name() == "#ff0000" for place in places))
"""


@pytest.mark.thorough
@pytest.mark.parametrize(("scale", "pixels"), [("1", "1"), ("2", "2")])
def test_horizontal_and_vertical_lines_are_one_logical_pixel_wide(scale, pixels):
    environment = {**os.environ, "QT_SCALE_FACTOR": scale}
    result = subprocess.run(
        [sys.executable, "-c", WIDTHS],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )
    assert result.stdout.split() == [pixels, pixels]
