"""Data for plots of a recording, in bounded memory: during the run, or of any part afterwards.

Live pictures cover the newest seconds: time histories, spectra, transmission, Responses I and II, phase
portrait, levels and impact count. Each picture is computed when it is drawn. A finished recording is drawn
from the smallest and largest of every 128 samples, which its file stores (docs/decisions/0020-overview.md).
An impact of three samples is therefore always visible. This package imports no Qt.

>>> import numpy as np
>>> from vibench.analysis.live import LiveChannel, LiveView
>>> channel = LiveChannel("m0_velocity", "m/s", units_per_volt=0.1, full_scale_v=10.0)
>>> view = LiveView([channel], 25600.0, band_hz=(10.0, 600.0))
>>> volts = 5.0 * np.sin(2 * np.pi * 50.0 * np.arange(25600) / 25600.0)
>>> view.add(0, volts[np.newaxis].astype(np.float32))
>>> histories = view.time_histories(span_s=1.0, columns=4)
>>> histories.high.round(3).tolist()
[[0.5, 0.5, 0.5, 0.5]]
>>> view.levels[0].verdict.name
'GOOD'
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
