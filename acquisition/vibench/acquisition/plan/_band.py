"""Which frequencies a measurement excites."""

from ..excitation import Excitation

_LOWEST = ("band_start_hz", "start_hz", "stop_hz", "frequency_hz")
_AROUND_A_SINE = 2.0
"""A single sine is looked at from half to twice its frequency."""


def excited_band_hz(excitation: Excitation) -> tuple[float, float]:
    """Lowest and highest frequency that is played [Hz]; an octave to either side of a single one."""
    highest = excitation.highest_frequency_hz
    named = [float(getattr(excitation, name)) for name in _LOWEST if hasattr(excitation, name)]
    listed = [float(value) for value in getattr(excitation, "rising_hz", ())]
    lowest = min((*named, *listed), default=highest)
    if lowest >= highest:
        return lowest / _AROUND_A_SINE, highest * _AROUND_A_SINE
    return lowest, highest
