"""Analysis: frequency responses, spectra, responses, figures and reports from recordings and predictions.

Functions are pure and results are immutable; values have an uncertainty where it can be computed. Units are
SI; names of quantities end with the unit. Errors state what was given, what is allowed and what to do. The
packages cover signals, recordings, frequency responses, sines, simulations overlaid on measurements, figures,
results and reports. They use recordings and plans of a bench, but no instruments and no windows. The names
below are imported on first use.

Example: a mass with a resonance at 95 Hz and a damping ratio of 0.01, on a base with random motion.

>>> import numpy as np
>>> from vibench.analysis import resonances, transmissibility
>>> rate_hz = 2048.0
>>> base = np.random.default_rng(1).standard_normal(60 * 2048)
>>> ratio = np.fft.rfftfreq(base.size, 1 / rate_hz) / 95.0
>>> factor = (1 + 0.02j * ratio) / (1 + 0.02j * ratio - ratio**2)
>>> mass = np.fft.irfft(factor * np.fft.rfft(base), base.size)
>>> found = transmissibility(base, mass, rate_hz, segment_samples=8192)
>>> (peak,) = resonances(found, low_hz=60.0, high_hz=140.0)
>>> print(f"{peak.frequency_hz:.1f} Hz, damping ratio {peak.damping_ratio:.2f}")
95.0 Hz, damping ratio 0.01
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
