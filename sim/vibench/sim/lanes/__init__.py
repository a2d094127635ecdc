"""Lanes: eight motions of one specimen side by side in a processor's vector registers, by their states alone.

A motion in flight is four turning terms of p; eight motions march together, and those that touch a stop
collide together, by polynomials (`vibench.sim.collision`). Each goes its own way by masks. What polynomials
do not hold, 2 per cent of contacts, is resolved by the steps of `vibench.sim.contact`. For Hertz's stops
and a harmonic drive, at *quick* and *standard*; nothing is observed on the way but the states once a drive
period (docs/decisions/0061-lanes.md).
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
