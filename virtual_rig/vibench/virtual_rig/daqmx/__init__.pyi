from ._devices import (
    catalogue_with as catalogue_with,
)
from ._faults import (
    Fault as Fault,
    ServerGone as ServerGone,
)
from ._rig import (
    OnDemandPace as OnDemandPace,
    Pace as Pace,
    WallPace as WallPace,
)
from ._server import (
    LOOPBACK as LOOPBACK,
    DaqServer as DaqServer,
)
from ._token import (
    token_for as token_for,
)
