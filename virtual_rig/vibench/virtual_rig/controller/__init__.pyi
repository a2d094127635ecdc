from ._virtual_controller import (
    VirtualController as VirtualController,
    controller_of as controller_of,
)
