from ._drive_level import (
    DriveLevel as DriveLevel,
    NoiseDriveLevel as NoiseDriveLevel,
    drive_level as drive_level,
    noise_drive_level as noise_drive_level,
)
from ._noise_lift import (
    noise_lift as noise_lift,
)
from ._order_tracking import (
    ALL_ORDERS as ALL_ORDERS,
    ORDERS as ORDERS,
    TrackedOrders as TrackedOrders,
    cycles_needed as cycles_needed,
    order_label as order_label,
    order_turns as order_turns,
    tracked_orders as tracked_orders,
)
from ._peaks import (
    peaks as peaks,
)
from ._sine_fit import (
    fitted_sine as fitted_sine,
    steady_phase as steady_phase,
)
