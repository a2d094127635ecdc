"""Chains of vibro-impact cells: specimens whose m0 hang on one another, and their impacts.

Cell i is a `Specimen`; its (k0, c0) join its m0 to that of the cell before, the first to the base; the far
end is free. A run goes window by window: in a window each cell with contact is followed in its own time,
the rest of the chain enters as a series and a memory (docs/decisions/0011-chains.md). Any drive;
no orbits and no branches of chains. Exponents are those of two neighbouring motions.

>>> from vibench.sim import gong2025
>>> from vibench.sim.chain import band_gaps, bloch_factor, chain_of, chain_transmissibility
>>> cell = chain_of(gong2025(), cells=1)
>>> [(round(gap.lower_hz, 1), round(gap.upper_hz, 1)) for gap in band_gaps(cell)]  # of endlessly many
[(96.1, 110.4), (373.4, 462.0), (701.3, inf)]
>>> round(float(abs(bloch_factor(cell, 400.0))[0]), 3)  # from cell to cell, in the second gap
0.121
>>> across = chain_transmissibility(chain_of(gong2025(), cells=4), 400.0)  # frequencies, cells, (x, y, z, p)
>>> [round(float(value), 4) for value in abs(across[0, :, 0])]
[0.1206, 0.0145, 0.0018, 0.0002]
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
