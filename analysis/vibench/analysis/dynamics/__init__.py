"""Requests for branches of periodic motions, Lyapunov spectra and chains, and their results.

Requests are stored with their results. Results are computed one by one, with their error and computing time.
They can be stored as HDF5 and overlaid on recordings as curves.

>>> from vibench.analysis.dynamics import BranchRequest, diagram_of
>>> request = BranchRequest(amplitude_m=5e-6, start=60.0, stop=62.0, places=2, starts=1)
>>> diagram = diagram_of(request)
>>> [line.points for line in diagram.lines][0] > 10, diagram.largest_error < 1e-6
(True, True)
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
