"""Whether the loop is closed: feedback must not push against a sensor that has come off."""

from ..errors import LimitExceeded
from ..plan import needed_vpp
from ..rig import OnTable, Rig

LEAST_ANSWER = 0.05
"""Share of the linear model's acceleration below which the loop is taken to be open. A specimen on its
resonance holds a light table back to about a fifth."""


def require_answer(rig: Rig, frequency_hz: float, setting_vpp: float, acceleration: float) -> None:
    """Refuse to go on when the base hardly answers.

    Parameters
    ----------
    acceleration
        Amplitude of the base's fundamental, as measured [m/s2].

    Raises
    ------
    LimitExceeded
        The run then ramps down.

    """
    modelled = setting_vpp / needed_vpp(rig, 1.0, frequency_hz, OnTable.NOTHING)
    if acceleration < LEAST_ANSWER * modelled:
        raise LimitExceeded(
            f"the base moved with {acceleration:.3g} m/s2 at {frequency_hz:g} Hz where the model says "
            f"{modelled:.3g} m/s2, and feedback needs {LEAST_ANSWER:.0%} of that. It was ramped down and "
            "its recording kept; look at the accelerometer, its cable and the amplifier"
        )
