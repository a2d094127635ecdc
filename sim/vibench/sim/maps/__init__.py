"""Maps of motions: over two parameters, over two coordinates of the initial state, or along one quantity.

A map is a plan as in `vibench.sim.study`; each point is a settled motion with its kind, period, responses and
impacts. Points on a coarse lattice are computed first, then points whose neighbours differ. All other points
are filled in by interpolation; a random sample is computed to estimate the error rate (docs/maps.md).

>>> from vibench.sim.maps import Map, Range, solve_map
>>> plan = Map(
...     frequency_hz=Range(start=120.0, stop=140.0, points=5),
...     amplitude_m=Range(start=1e-6, stop=2e-5, points=3),
... )
>>> results = solve_map(plan, workers=1)
>>> results.is_complete, results.values("response_i").shape
(True, (3, 1, 5))
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
