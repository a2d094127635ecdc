"""Motion under a power law, a sum of odd powers of p: a force that acts at every p, with no flight.

Harmonic drive: long steps, the force at eight Gauss points found by substitution, the linear part as a
Taylor series of the matrix exponential (docs/decisions/0026-power-laws.md). Sampled or swept drive: Dormand
and Prince's order 8(5,3) in time (`smooth`). Peaks, lines, samples and the variation are those of the step
itself.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
