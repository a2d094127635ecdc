"""What is chosen before a figure is drawn, and the columns beside it; needs no drawing library."""

from ..figures.image_kind import ImageKind
from ..figures.map_quantities import SHOWN
from ..tables import Table, table

__all__ = ["SHOWN", "ImageKind", "Table", "table"]
