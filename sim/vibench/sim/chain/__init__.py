"""Chains of vibro-impact cells: specimens coupled at their m0.

Cell i is a `Specimen` whose (k0, c0) couple its m0 to the previous cell, or to the base; the far end is free.
A run is divided into short windows. In each window, every cell in contact is integrated alone, and a Taylor
series gives the motion of the rest of the chain (docs/decisions/0011-chains.md). All drives are supported;
periodic orbits and branches are not. Lyapunov exponents are computed from two neighbouring motions.

>>> from vibench.sim import gong2025
>>> from vibench.sim.chain import band_gaps, bloch_factor, chain_of, chain_transmissibility
>>> cell = chain_of(gong2025(), cells=1)
>>> [(round(gap.lower_hz, 1), round(gap.upper_hz, 1)) for gap in band_gaps(cell)]  # of the infinite chain
[(96.1, 110.4), (373.4, 462.0), (701.3, inf)]
>>> round(float(abs(bloch_factor(cell, 400.0))[0]), 3)  # amplitude ratio of successive cells, in a band gap
0.121
>>> across = chain_transmissibility(chain_of(gong2025(), cells=4), 400.0)  # shape (1, 4 cells, x y z p)
>>> [round(float(value), 4) for value in abs(across[0, :, 0])]
[0.1206, 0.0145, 0.0018, 0.0002]
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
