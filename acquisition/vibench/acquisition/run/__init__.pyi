from ._acquisition_loop import (
    BLOCK_S as BLOCK_S,
)
from ._drive import (
    Drive as Drive,
    drive_for as drive_for,
)
from ._drive_guard import (
    DriveGuard as DriveGuard,
)
from ._ending import (
    Outcome as Outcome,
    Progress as Progress,
)
from ._run_measurement import (
    run_measurement as run_measurement,
)
