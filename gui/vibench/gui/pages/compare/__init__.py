"""The Compare page: recordings and predictions laid over one another.

Curves with their bounds over frequency, peaks, markers, the difference of two curves, export.
Analyses and exports run in another process; `_export_elsewhere` is loaded there, without widgets.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
