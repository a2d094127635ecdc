from ._virtual_controller import (
    VirtualController as VirtualController,
)
