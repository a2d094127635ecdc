"""Figures of measurements and of what the model says of them, one a file, drawn without a display.

Each is a matplotlib figure with its caption and the plotted numbers, saved as PNG, SVG or PDF and CSV;
the same data give the same bytes. Colours are distinguished by colour-blind readers.
"""

from vibench.acquisition import need_extra

need_extra("figures")
