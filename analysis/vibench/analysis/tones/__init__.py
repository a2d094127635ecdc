"""Sines in a signal: their frequency, amplitude and phase, peaks of spectra, and orders of the drive.

Here the drive amplitude A0 of the paper, base displacement [m], is found from recorded base acceleration,
and how far noise lifts the largest value of a window.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
