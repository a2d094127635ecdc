"""Figures of measurements and simulations, drawn without a display; one module for each figure.

Each figure has a caption and tables of the plotted numbers. Figures are saved as PNG, SVG or PDF, and tables
as CSV. The same data give identical files. Colour-blind readers can distinguish the colours.
"""

from vibench.acquisition import require_extra

require_extra("figures")
