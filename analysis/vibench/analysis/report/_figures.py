"""Figures without a recording, and the common style for your own figures."""

from ..figures.chain import chain_figure
from ..figures.maps import branches_figure, draw_line, map_figure
from ..figures.predictions import contact_forces_figure, curve_figure, exponent_spectrum_figure
from ..figures.style import (
    COLLIDING,
    LEVEL_STYLES,
    LEVELS,
    LINEAR,
    MEASURED,
    SIMULATED,
    TERMINAL,
    DrawnFigure,
    figure_style,
    frequency_axis,
    legend_above,
    magnitude_axis,
    new_figure,
)

__all__ = [
    "COLLIDING",
    "LEVELS",
    "LEVEL_STYLES",
    "LINEAR",
    "MEASURED",
    "SIMULATED",
    "TERMINAL",
    "DrawnFigure",
    "branches_figure",
    "chain_figure",
    "contact_forces_figure",
    "curve_figure",
    "draw_line",
    "exponent_spectrum_figure",
    "figure_style",
    "frequency_axis",
    "legend_above",
    "magnitude_axis",
    "map_figure",
    "new_figure",
]
