"""Estimate the hidden motion of m1 against m2, and its impacts, from base acceleration and m0's velocity.

Two methods run side by side: one without a contact model, and an extended Kalman filter that also finds
gaps, m1, c1 and the contact law. Every result has an uncertainty, or the reason why the data do not
determine it. Equations and figures: docs/hidden-motion.md.

In this example, a sine of 5 um makes the paper's specimen collide, and m0's velocity has a little noise:

>>> import numpy as np
>>> from vibench.analysis.hidden_motion import Numbers, hidden_motion_in_samples
>>> from vibench.sim import Sampled, gong2025, integrate
>>> rate_hz, specimen = 51200.0, gong2025()
>>> time_s = np.arange(20480) / rate_hz
>>> base_m = 5e-6 * np.clip(time_s / 0.05, 0, 1) ** 3 * np.sin(2 * np.pi * 260 * time_s)
>>> path = integrate(specimen, Sampled(base_m, rate_hz), 0.39, sample_rate_hz=rate_hz)
>>> count = path.states.shape[0]
>>> rng = np.random.default_rng(1)
>>> acceleration = np.gradient(np.gradient(base_m, 1 / rate_hz), 1 / rate_hz)[:count]
>>> acceleration += 5e-3 * rng.standard_normal(count)
>>> velocity = path.states[:, 3] + 6e-6 * rng.standard_normal(count)
>>> told = hidden_motion_in_samples(acceleration, velocity, rate_hz, specimen, Numbers.AS_DESCRIBED)
>>> met = path.impacts.times_s * rate_hz - told.first_sample
>>> late = met > 5000
>>> found = told.tracked.collisions.samples
>>> worst = max(np.min(np.abs(found - each)) for each in met[late][:-1]) / rate_hz
>>> print(f"all impacts found within {1e6 * worst:.0f} us")
all impacts found within 0 us
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
