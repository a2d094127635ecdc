"""Figures of measurements and of what the model says of them, one a file, drawn without a display.

Each is a matplotlib figure with its caption and the plotted numbers, saved as PNG, SVG or PDF and CSV;
the same data give the same bytes. Colours are told apart by colour-blind readers.
"""

from ._backbone import (
    backbone_figure,
)
from ._bench_levels import (
    bench_levels_figure,
)
from ._comparison import (
    comparison_figure,
)
from ._distortion import (
    distortion_figure,
)
from ._drawn import (
    DrawnFigure,
    ImageKind,
)
from ._dwells import (
    dwells_figure,
)
from ._excitation import (
    excitation_figure,
)
from ._hysteresis import (
    hysteresis_figure,
)
from ._portraits import (
    portraits_figure,
    verdict_text,
)
from ._stepped_sine import (
    stepped_level_caption,
    stepped_sine_figure,
)
from ._style import (
    COLLIDING,
    LEVEL_STYLES,
    LEVELS,
    LINEAR,
    MEASURED,
    PREDICTED,
    SIMULATED,
    TERMINAL,
    frequency_axis,
    legend_above,
    magnitude_axis,
    new_figure,
    styled,
)
from ._sweep import (
    regions_text,
    sweep_figure,
)
from ._sweep_orders import (
    sweep_orders_figure,
)
from ._tradeoff import (
    tradeoff_figure,
)
from ._transmission import (
    transmission_figure,
)
from ._transmission_levels import (
    transmission_levels_figure,
)

__all__ = [
    "COLLIDING",
    "LEVELS",
    "LEVEL_STYLES",
    "LINEAR",
    "MEASURED",
    "PREDICTED",
    "SIMULATED",
    "TERMINAL",
    "DrawnFigure",
    "ImageKind",
    "backbone_figure",
    "bench_levels_figure",
    "comparison_figure",
    "distortion_figure",
    "dwells_figure",
    "excitation_figure",
    "frequency_axis",
    "hysteresis_figure",
    "legend_above",
    "magnitude_axis",
    "new_figure",
    "portraits_figure",
    "regions_text",
    "stepped_level_caption",
    "stepped_sine_figure",
    "styled",
    "sweep_figure",
    "sweep_orders_figure",
    "tradeoff_figure",
    "transmission_figure",
    "transmission_levels_figure",
    "verdict_text",
]
