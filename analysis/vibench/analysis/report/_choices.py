"""Tables and choices for figures; importing this module needs no drawing library."""

from ..tables import SHOWN, ImageKind, Table, table

__all__ = ["SHOWN", "ImageKind", "Table", "table"]
