from ._control_action import (
    Controller as Controller,
    phase_samples as phase_samples,
)
from ._controllers import (
    CONTROLLERS as CONTROLLERS,
    feedback_controller as feedback_controller,
)
from ._fast_loop import require_holdable as require_holdable
