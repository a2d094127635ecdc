"""Figures of measurements with the model's results; one file for each figure, drawn without a display.

Each is a matplotlib figure with its caption and the plotted numbers, saved as PNG, SVG or PDF and CSV;
the same data give the same bytes. Colour-blind readers can tell the colours apart.
"""

from vibench.acquisition import need_extra

need_extra("figures")
