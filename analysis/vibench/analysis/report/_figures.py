"""Figures that belong to no recording."""

from ..figures import (
    DrawnFigure,
    branches_figure,
    chain_figure,
    contact_forces_figure,
    exponent_spectrum_figure,
    map_figure,
    tradeoff_figure,
)
from ..paper_figures import PAPER_FIGURES, levels_figure

__all__ = [
    "PAPER_FIGURES",
    "DrawnFigure",
    "branches_figure",
    "chain_figure",
    "contact_forces_figure",
    "exponent_spectrum_figure",
    "levels_figure",
    "map_figure",
    "tradeoff_figure",
]
