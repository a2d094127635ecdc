"""Figures of measurements and simulations, drawn without a display; one module for each figure.

Each figure has a caption and tables of the plotted numbers. It is saved as PNG, SVG or PDF, the tables as
CSV; the same data give identical files. The colours are distinguishable for colour-blind readers.
"""

from vibench.acquisition import require_extra

require_extra("figures")
