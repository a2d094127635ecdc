"""Branches of periodic motions, spectra of exponents and chains of the model, as a person asks for them.

What is asked is a value that a file keeps; answers come one by one, as columns of numbers with their errors
and costs, are kept as HDF5 and read back, and are turned into curves that are overlaid on recordings.

>>> from vibench.analysis.dynamics import BranchRequest, diagram_of
>>> request = BranchRequest(amplitude_m=5e-6, start=60.0, stop=62.0, places=2, starts=1)
>>> diagram = diagram_of(request)
>>> [line.points for line in diagram.lines][0] > 10, diagram.largest_error < 1e-6
(True, True)
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
