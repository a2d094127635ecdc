"""The analogue world between the generator's terminal and the converter's inputs, on a grid of time.

Amplifier, shaker and specimen in one compiled loop (docs/decisions/0006-virtual-rig.md), vibrometer and
accelerometer, cables, input stages, anti-alias filter, noise from seeds. Quantities are means over a
step, SI units; rig time counts by the converter's clock. Knows neither SCPI nor DAQmx.
"""

from ._time_grid import (
    FULL_BAND_HZ,
    relative_clock_ppm,
)
from ._warm_up import (
    warm_up,
)
from ._world import World, virtual_section

__all__ = [
    "FULL_BAND_HZ",
    "World",
    "relative_clock_ppm",
    "virtual_section",
    "warm_up",
]
