"""Figures of measurements and of what the model says of them, one a file, drawn without a display.

Each is a matplotlib figure with its caption and the plotted numbers, saved as PNG, SVG or PDF and CSV;
the same data give the same bytes. Colours are told apart by colour-blind readers.
"""

import lazy_loader

from vibench.acquisition import naming_its_extra

_found, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
__getattr__ = naming_its_extra(_found, "figures")
