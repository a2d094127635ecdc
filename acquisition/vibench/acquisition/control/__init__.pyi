from ._control_action import (
    Controller as Controller,
    phase_samples as phase_samples,
)
from ._controllers import (
    feedback_controller as feedback_controller,
)
