"""The Run page: arming in plain words, starting, and live pictures of the run.

Newest seconds of every channel, spectra, transmissibility with coherence, phase portrait and
Poincaré section, responses over the frequency played, level meters. Samples come from the live
view of the engine link; the file holds more than is drawn.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
