"""Controllers of measurements whose next step depends on what was measured."""

from typing import assert_never

from ..excitation import AbstractFeedback, HeldDwell, HeldSweep, ResonanceTracking, SettledSine
from ..plan import Measurement
from ..rig import Channel, Rig
from ._control_action import Controller
from ._dwell_controller import hold_dwell
from ._feedback_channels import feedback_channels_of
from ._resonance_controller import track_resonance
from ._settled_controller import step_settled
from ._sine_loop import SineLoop
from ._sweep_controller import hold_sweep


def feedback_controller(
    measurement: Measurement, rig: Rig, channels: tuple[Channel, ...], sample_rate_hz: float
) -> Controller[None]:
    """Control a measurement with feedback, from its ramp up to its ramp down.

    Raises
    ------
    ConfigurationError
        When the rig lacks a channel that feedback listens to; before anything is yielded.

    """
    excitation = measurement.excitation
    assert isinstance(excitation, AbstractFeedback), "only feedback needs a controller"
    loop = SineLoop(feedback_channels_of(channels, sample_rate_hz), rig, measurement)
    match excitation:
        case SettledSine():
            return step_settled(loop, excitation)
        case HeldDwell():
            return hold_dwell(loop, excitation)
        case HeldSweep():
            return hold_sweep(loop, excitation)
        case ResonanceTracking():
            return track_resonance(loop, excitation)
        case _:
            assert_never(excitation)
