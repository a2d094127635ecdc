"""The simulated DAQ: NI's DAQmx service over gRPC, for the unmodified nidaqmx.

Devices, tasks, channels, timing, attributes, events and errors as the driver reports them, and the pace
at which rig time passes: when somebody asks for samples, or by the wall clock. What is converted and
played goes through `vibench.virtual_rig.analogue`: it does not know the world behind the sockets. Sources
of the device table stand in it.
"""

from ._devices import (
    catalogue_with,
)
from ._faults import (
    Fault,
    ServerGone,
)
from ._pace import (
    OnDemandPace,
    Pace,
    WallPace,
)
from ._server import (
    LOOPBACK,
    DaqServer,
    serve,
)
from ._token import (
    token_for,
)

__all__ = [
    "LOOPBACK",
    "DaqServer",
    "Fault",
    "OnDemandPace",
    "Pace",
    "ServerGone",
    "WallPace",
    "catalogue_with",
    "serve",
    "token_for",
]
