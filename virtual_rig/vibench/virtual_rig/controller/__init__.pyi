from ._answer import (
    LoopParts as LoopParts,
    answer as answer,
    wants_attention as wants_attention,
)
from ._virtual_controller import (
    VirtualController as VirtualController,
    controller_of as controller_of,
)
