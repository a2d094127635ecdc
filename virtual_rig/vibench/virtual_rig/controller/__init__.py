"""The simulated real-time controller: a law and a Fourier series, sample by sample, and lines of JSON.

It speaks version 1 of the protocol of `vibench.acquisition.instruments`. Its watchdog counts its own samples:
when no host has said anything for so long it ramps down, and needs nobody for that.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
