"""Maps of motions over two parameters, over two coordinates of the start, or along one of them.

A map is a plan as in `vibench.sim.study` whose points are settled motions: kind, period, responses, impacts.
Points on a coarse lattice are computed first, then points whose neighbours differ; all other points are
filled in by interpolation. A random sample of these is computed to estimate the error rate (docs/maps.md).

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
