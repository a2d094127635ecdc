"""Export recordings for other programs, and import their files; one module per format.

Export writes CSV, MATLAB 5, UFF 58, NeXus and WAV in blocks, or returns a labelled xarray Dataset. A failed
export leaves no file, and no file is overwritten. Import reads these files, HDF5 of any layout and TDMS, with
a mapping of channels. Nothing in a file is ever executed. See docs/exchange.md.

>>> import numpy as np
>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> from vibench.analysis.exchange import open_source
>>> with TemporaryDirectory() as folder:
...     path = Path(folder) / "bench.csv"
...     rows = [(0.0, 0.0), (0.5, 0.2), (1.0, 0.1)]
...     np.savetxt(path, rows, delimiter=",", header="time [s],velocity [m/s]", comments="")
...     with open_source(path) as source:
...         for channel in source.channels:
...             print(channel.name, channel.label, channel.unit, channel.sample_rate_hz)
1 time s 2.0
2 velocity m/s 2.0
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
