"""Tables and choices for figures; importing this module needs no drawing library."""

from ..figure_choices import SHOWN, ImageKind
from ..tables import Table, table

__all__ = ["SHOWN", "ImageKind", "Table", "table"]
