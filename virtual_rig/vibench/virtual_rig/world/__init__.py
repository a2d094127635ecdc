"""The analogue world between the generator's terminal and the converter's inputs, on a grid of time.

Amplifier, shaker and specimen in one loop of the native engine (`vibench.sim.shaker`), vibrometer and
accelerometer, cables, input stages, anti-alias filter, noise from seeds. Quantities are means over a
step, SI units; rig time counts by the converter's clock. Knows neither SCPI nor DAQmx.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
