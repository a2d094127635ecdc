"""Sines in a signal: their frequency, amplitude and phase, peaks of spectra, and orders of the drive.

Here the drive amplitude A0 of the paper, base displacement [m], is found from recorded base acceleration,
and how far noise lifts the largest value of a window.
"""

from ._drive_level import (
    DriveLevel,
    NoiseDriveLevel,
    drive_level,
    noise_drive_level,
)
from ._noise_bias import (
    noise_bias,
)
from ._order_tracking import (
    ALL_ORDERS,
    ORDERS,
    TrackedOrders,
    cycles_needed,
    order_label,
    tracked_orders,
)
from ._peaks import (
    peaks,
)
from ._sine_fit import (
    fitted_sine,
    steady_phase,
)

__all__ = [
    "ALL_ORDERS",
    "ORDERS",
    "DriveLevel",
    "NoiseDriveLevel",
    "TrackedOrders",
    "cycles_needed",
    "drive_level",
    "fitted_sine",
    "noise_bias",
    "noise_drive_level",
    "order_label",
    "peaks",
    "steady_phase",
    "tracked_orders",
]
