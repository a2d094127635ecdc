from ._fault_script import (
    load_fault_script as load_fault_script,
)
from ._virtual_rig import (
    DiskFaults as DiskFaults,
    VirtualRig as VirtualRig,
)
