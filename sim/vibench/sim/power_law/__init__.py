"""Motion under a power law with a sampled or swept drive: a force that acts at every p, with no flight.

Dormand and Prince's order 8(5,3) in time. Harmonic drives take the long steps of `vibench.sim.engine`
(docs/decisions/0026-power-laws.md).
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
