"""What is chosen before a figure is drawn; needs no drawing library."""

from ..figures import SHOWN, ImageKind
from ..paper_figures import FigureOptions, FrequencyGrid

__all__ = ["SHOWN", "FigureOptions", "FrequencyGrid", "ImageKind"]
