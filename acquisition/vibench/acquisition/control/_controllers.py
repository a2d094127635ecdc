"""Who conducts a measurement whose next step depends on what was heard."""

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
    """Conduct a measurement with feedback, from its ramp up to its ramp down.

    Raises
    ------
    ConfigurationError
        When the rig lacks a channel that feedback listens to; before anything is yielded.

    """
    excitation = measurement.excitation
    assert isinstance(excitation, AbstractFeedback), "only feedback needs a conductor"
    play = SineLoop(feedback_channels_of(channels, sample_rate_hz), rig, measurement)
    match excitation:
        case SettledSine():
            return step_settled(play, excitation)
        case HeldDwell():
            return hold_dwell(play, excitation)
        case HeldSweep():
            return hold_sweep(play, excitation)
        case ResonanceTracking():
            return track_resonance(play, excitation)
        case _:
            assert_never(excitation)
