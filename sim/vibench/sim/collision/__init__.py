"""Whole Hertz collisions as polynomials of speed and course, fitted for a specimen: what lanes take.

<<<<<<< HEAD
Motions of one specimen and of chains are followed by `vibench.sim.engine`, which finds each collision.
=======
Measured by their own depth and time, collisions differ only by how hard the other springs press: the
shapes, and how they answer a misfit, are tabulated by that and then corrected
(docs/decisions/0008-speed-of-contacts.md). Where a few corrections do not suffice (next to no speed,
springs as fast as the collision, an instant to stop at in the midst of it) nothing is done here, and the
collision is resolved in steps. Used by chains; motions of
one specimen are followed by `vibench.sim.engine`.
>>>>>>> d05a509c (Follow batches of motions in native code)
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
