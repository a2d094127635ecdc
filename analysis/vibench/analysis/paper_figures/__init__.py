"""The figures of the paper that simulation draws, from our own studies; one file a figure.

What the paper leaves open (damping, grid, logarithm, similarity's upper end) is a named option that is
kept with every figure. Figures 12 to 14 show the experiment and are drawn from recordings, in figures.
"""

from ._catalogue import (
    PAPER_FIGURES,
)
from ._fig03_levels import (
    levels_figure,
)
from ._fig11_clearance import (
    GAPS_M,
    clearance_studies,
)
from ._options import (
    AMPLITUDES_M,
    FigureOptions,
    FrequencyGrid,
)
from ._responses import (
    Responses,
    drive_at,
    responses,
)
from ._time_signal import TimeSignal, time_signal

__all__ = [
    "AMPLITUDES_M",
    "GAPS_M",
    "PAPER_FIGURES",
    "FigureOptions",
    "FrequencyGrid",
    "Responses",
    "TimeSignal",
    "clearance_studies",
    "drive_at",
    "levels_figure",
    "responses",
    "time_signal",
]
