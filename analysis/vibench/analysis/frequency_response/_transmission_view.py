"""In which quantities, and on which scale, a transmission is shown."""

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from ..errors import InvalidRequest
from ..signals import Quantity, Reals, derivative_factor
from ._results import Transmission, converted_transmission


class MagnitudeScale(StrEnum):
    """How magnitudes are drawn."""

    LOG = "log"
    """The ratio itself on a logarithmic axis."""
    DECIBEL = "db"
    """20 log10 of the ratio on a linear axis."""


_ABOVE_AND_BELOW = 2
_SYMBOLS = {Quantity.DISPLACEMENT: "x", Quantity.VELOCITY: "v", Quantity.ACCELERATION: "a"}
_BASE_SYMBOLS = {Quantity.DISPLACEMENT: "U", Quantity.VELOCITY: "U'", Quantity.ACCELERATION: "U''"}
_UNITS = {-2: "s²", -1: "s", 0: "", 1: "1/s", 2: "1/s²"}


@dataclass(frozen=True)
class TransmissionView:
    """The motion of m0 over the motion of the base."""

    response: Quantity = Quantity.DISPLACEMENT
    base: Quantity = Quantity.DISPLACEMENT
    scale: MagnitudeScale = MagnitudeScale.LOG

    @property
    def power(self) -> int:
        """How often i omega multiplies displacement over displacement."""
        return self.response.derivatives - self.base.derivatives

    @property
    def unit(self) -> str:
        """Of the magnitude; empty for a plain ratio."""
        return _UNITS[self.power]

    @property
    def name(self) -> str:
        """``"velocity/acceleration"``: what `quantities_named` reads."""
        return f"{self.response.value}/{self.base.value}"

    @property
    def symbol(self) -> str:
        """``"|x / U|"``, for captions and axes."""
        return f"|{_SYMBOLS[self.response]} / {_BASE_SYMBOLS[self.base]}|"

    @property
    def label(self) -> str:
        """Text of the magnitude axis."""
        unit = self.unit
        match self.scale:
            case MagnitudeScale.LOG:
                return f"{self.symbol}{f' [{unit}]' if unit else ''}  (m0 over base)"
            case MagnitudeScale.DECIBEL:
                return f"{self.symbol} [dB re 1{f' {unit}' if unit else ''}]"

    def factor(self, frequency_hz: Reals) -> Reals:
        """Give what turns magnitudes of displacement over displacement into the view's quantities."""
        start, stop = (Quantity.DISPLACEMENT, list(Quantity)[abs(self.power)])
        steps = (start, stop) if self.power >= 0 else (stop, start)
        return np.asarray(np.abs(derivative_factor(frequency_hz, *steps)))

    def shown(self, transmission: Transmission) -> Transmission:
        """Turn displacement over displacement into the view's quantities, bounds included."""
        return converted_transmission(
            transmission,
            drive=(Quantity.DISPLACEMENT, self.base),
            response=(Quantity.DISPLACEMENT, self.response),
        )

    def drawn(self, magnitude: Reals) -> Reals:
        """Turn magnitudes into the heights that are drawn."""
        match self.scale:
            case MagnitudeScale.LOG:
                return magnitude
            case MagnitudeScale.DECIBEL:
                with np.errstate(divide="ignore"):
                    return np.asarray(20 * np.log10(magnitude))


def quantities_named(text: str, scale: MagnitudeScale = MagnitudeScale.LOG) -> TransmissionView:
    """Read ``"velocity/acceleration"``; a single word stands for both.

    Raises
    ------
    InvalidRequest
        For anything else.

    """
    words = text.split("/")
    known = {each.value: each for each in Quantity}
    if len(words) > _ABOVE_AND_BELOW or any(word not in known for word in words):
        raise InvalidRequest(
            f"the quantity {text!r} is not known; give m0's over the base's, each one of "
            f"{', '.join(known)}, such as velocity/acceleration"
        )
    found = TransmissionView(response=known[words[0]], base=known[words[-1]])
    return replace(found, scale=scale)
