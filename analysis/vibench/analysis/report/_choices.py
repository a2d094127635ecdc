"""What is chosen before a figure is drawn, and the columns beside it; needs no drawing library."""

from ..figure_choices import SHOWN, ImageKind
from ..tables import Table, table

__all__ = ["SHOWN", "ImageKind", "Table", "table"]
