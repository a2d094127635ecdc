"""Spectra of long signals: densities with confidence bounds, amplitude spectra, spectrograms.

Records arrive block by block, and memory does not grow with them. Segments that touch lost samples
are left out and counted. An amplitude spectrum reads a sine as its amplitude.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
