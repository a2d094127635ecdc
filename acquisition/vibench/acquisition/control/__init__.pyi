from ._control_action import (
    Conduct as Conduct,
    heard as heard,
)
from ._controllers import (
    conduct as conduct,
)
