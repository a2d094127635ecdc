"""Who conducts a measurement whose next step depends on what was heard."""

from typing import assert_never

from ..excitation.held_dwell import HeldDwell
from ..excitation.held_sweep import HeldSweep
from ..excitation.plan import AbstractFeedback
from ..excitation.resonance_tracking import ResonanceTracking
from ..excitation.settled_sine import SettledSine
from ..plan.measurement import Measurement
from ..rig.channel import Channel
from ..rig.configuration import Rig
from .dwell_conductor import hold_dwell
from .ears import ears_of
from .move import Conduct
from .resonance_conductor import track_resonance
from .settled_conductor import step_settled
from .sine_play import SinePlay
from .sweep_conductor import hold_sweep


def conduct(
    measurement: Measurement, rig: Rig, channels: tuple[Channel, ...], sample_rate_hz: float
) -> Conduct[None]:
    """Conduct a measurement with feedback, from its ramp up to its ramp down.

    Raises
    ------
    ConfigurationError
        When the rig lacks a channel that feedback listens to; before anything is yielded.

    """
    excitation = measurement.excitation
    assert isinstance(excitation, AbstractFeedback), "only feedback needs a conductor"
    play = SinePlay(ears_of(channels, sample_rate_hz), rig, measurement)
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
