"""Controllers of measurements with feedback, by kind of excitation."""

from collections.abc import Callable, Mapping
from typing import Any

from ..instruments import PlugInKind, plug_in
from ..plan import Measurement
from ..rig import Channel, Rig
from .control_action import Controller
from .feedback_channels import feedback_channels_of
from .jump_controller import step_settled
from .noise_controller import equalise_noise
from .resonance_controller import track_resonance
from .settling_controller import hold_dwell, hold_sweep
from .sine_loop import SineLoop, hold_response

CONTROLLERS: Mapping[str, Callable[[SineLoop, Any], Controller[None]]] = {
    "settled_sine": step_settled,
    "held_dwell": hold_dwell,
    "held_sweep": hold_sweep,
    "resonance_tracking": track_resonance,
    "held_noise": equalise_noise,
    "held_response": hold_response,
}
"""Functions that return the controller for a loop and a plan, keyed by kind of excitation."""


def feedback_controller(
    measurement: Measurement, rig: Rig, channels: tuple[Channel, ...], sample_rate_hz: float
) -> Controller[None]:
    """Return the controller of a measurement with feedback, from its ramp up to its ramp down.

    The controller yields one phase after another and is sent the samples of each phase, shape (channels, n)
    [V]; ``channels`` lists the channels in the order of these rows. Raises ConfigurationError, before any
    phase, when the rig has no channel that feedback needs, or no package offers the controller.
    """
    loop = SineLoop(feedback_channels_of(channels, sample_rate_hz), rig, measurement)
    kind = measurement.excitation.kind
    control = CONTROLLERS.get(kind) or plug_in(PlugInKind.FEEDBACK, kind)
    controller: Controller[None] = control(loop, measurement.excitation)
    return controller
