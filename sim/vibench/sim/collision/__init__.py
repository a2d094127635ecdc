"""Whole Hertz collisions as polynomials of speed and course, fitted for a specimen: what lanes take.

Motions of one specimen and of chains are followed by `vibench.sim.engine`, which finds each collision.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
