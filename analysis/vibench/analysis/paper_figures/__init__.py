"""The figures of the paper that simulation draws, from our own studies; one file a figure.

What the paper leaves open (damping, grid, logarithm, similarity's upper end) is a named option that is
kept with every figure. Figures 12 to 14 show the experiment and are drawn from recordings, in figures.
"""

import lazy_loader

from vibench.acquisition import naming_its_extra

_found, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
__getattr__ = naming_its_extra(_found, "figures")
