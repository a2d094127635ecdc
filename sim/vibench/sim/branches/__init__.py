"""Branches of periodic motions over drive frequency or level, with switching at bifurcations.

`shoot_branches` searches for motions from rest, from the linear motion between the stops and from random
states, and follows each motion by shooting. It also follows branches that fork off where a period doubles or
a symmetry breaks. `balance_branches` does the same for harmonic balances, including the paper's. Branches are
computed one by one, on demand. A motion on no known branch starts a new branch, which may be isolated.

>>> from itertools import islice
>>> from vibench.sim import FrequencyPath, gong2025
>>> from vibench.sim.branches import MotionSearch, shoot_branches
>>> search = MotionSearch(places=2, starts=2)
>>> (found,) = islice(shoot_branches(gong2025(), FrequencyPath((5e-6,)), 60.0, 62.0, search), 1)
>>> found.periods, bool(found.branch.is_stable.all()), found.branch.frequencies_hz[[0, -1]].tolist()
(1, True, [60.0, 62.0])
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
