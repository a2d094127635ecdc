"""Formats of figures; options of commands name them where matplotlib is not installed."""

from enum import StrEnum


class ImageKind(StrEnum):
    """Formats that a figure is written in; the value is the files' suffix."""

    PNG = "png"
    SVG = "svg"
    PDF = "pdf"
