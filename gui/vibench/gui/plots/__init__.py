"""Plots on pyqtgraph: axes with units, 1-2-5 ticks, envelopes, legends, themes.

Values are SI; the unit of a label is chosen by its axis. Long signals are drawn as smallest and
largest sample of every column of pixels, so that no impact is lost.
It knows nothing of what is drawn.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
