"""Runs: flight, contact, impact and sticking joined, under a piecewise cubic drive.

A run advances one state vector in place; what is sampled on the way never changes a step. Drives that are not
harmonic are cut into intervals on which the base is a cubic, U(tau) = c0 + c1 tau + c2 tau^2 + c3 tau^3 [m]
(docs/decisions/0004-contact-integration.md). `vibench.sim.shaker` steps a specimen inside a loop of its own:
tables once, a state, then one call an interval, also from a compiled kernel (`kernel`). Tables may be shared
by threads.

>>> import numpy as np
>>> from vibench.sim import gong2025
>>> from vibench.sim.stepping import advance_interval, base_reaction, interval_tables, new_state
>>> specimen = gong2025()
>>> tables, state = interval_tables(specimen, interval_s=1e-4), new_state(specimen)
>>> speed = 0.1  # m/s: the base sets off and goes on
>>> cubics = (np.array([speed * 1e-4 * k, speed, 0.0, 0.0]) for k in range(100))
>>> impacts = sum(advance_interval(state, cubic, tables) for cubic in cubics)
>>> impacts, round(1e3 * float(state[0]), 2)  # and x in mm, after 10 ms
(6, 1.01)
>>> round(base_reaction(state, 1e-3, speed, tables), 2)  # N
0.23
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
