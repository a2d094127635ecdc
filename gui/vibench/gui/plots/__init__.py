"""Plots on pyqtgraph: axes with units, 1-2-5 ticks, envelopes, legends, themes.

Values are SI; the unit of a label is chosen by its axis. Long signals are drawn as smallest and
largest sample of every column of pixels, so that no impact is lost.
It knows nothing of what is drawn.
"""

from ._axis import FREQUENCY, LOG_FREQUENCY, TIME, PlotAxis, Scale
from ._bar_delegate import (
    SHARE_ROLE,
    BarDelegate,
)
from ._line_style import GUIDE, LIMIT, PREDICTED, Dash, LineStyle, curve_style
from ._plot import Plot
from ._signal_curve import (
    SignalCurve,
)

__all__ = [
    "FREQUENCY",
    "GUIDE",
    "LIMIT",
    "LOG_FREQUENCY",
    "PREDICTED",
    "SHARE_ROLE",
    "TIME",
    "BarDelegate",
    "Dash",
    "LineStyle",
    "Plot",
    "PlotAxis",
    "Scale",
    "SignalCurve",
    "curve_style",
]
