"""Figures of measurements and simulations, drawn without a display; one module for each figure.

Each has a caption and tables of the plotted numbers. It is saved as PNG, SVG or PDF, and CSV; the same data
give the same bytes. Colour-blind readers can distinguish the colours.
"""

from vibench.acquisition import need_extra

need_extra("figures")
