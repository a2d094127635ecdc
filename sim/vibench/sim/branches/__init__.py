"""All periodic motions over drive frequency or level: found, followed, switched at bifurcations, told apart.

`shot_branches` looks for motions from rest, from the motion between the stops and from random states, follows
each one exactly, and switches where a period doubles or a symmetry breaks; `balanced_branches` does the same
for harmonic balances, the paper's first-order ones among them. Branches are given one by one, as found: what
nobody asks for is not computed. A motion on no branch that was known is the start of an isolated one.

>>> from itertools import islice
>>> from vibench.sim import FrequencyPath, gong2025
>>> from vibench.sim.branches import MotionSearch, shot_branches
>>> search = MotionSearch(places=2, starts=2)
>>> (found,) = islice(shot_branches(gong2025(), FrequencyPath((5e-6,)), 60.0, 62.0, search), 1)
>>> found.periods, bool(found.branch.is_stable.all()), found.branch.frequencies_hz[[0, -1]].tolist()
(1, True, [60.0, 62.0])
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
