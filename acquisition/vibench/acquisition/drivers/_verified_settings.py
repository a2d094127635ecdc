"""Settings that are read back: what the instrument holds is compared with what was sent."""

from dataclasses import dataclass

from ..errors import SettingRefused
from ._scpi import ScpiPort, number_in


@dataclass(frozen=True)
class Tolerance:
    """How far a number read back may lie from the one sent: the resolution of the instrument."""

    absolute: float
    relative: float

    def covers(self, sent: float, got: float) -> bool:
        """Whether both are the same setting."""
        return abs(got - sent) <= self.absolute + self.relative * abs(sent)


@dataclass(frozen=True)
class VerifiedSettings:
    """Sets through a SCPI port and reads back every setting.

    This family answers a value out of range with a silent default (Tektronix AFG1000 programmer
    manual, general syntax), so that a command without a complaint proves nothing.
    """

    port: ScpiPort
    name: str

    def set_number(self, header: str, sent: float, text: str, tolerance: Tolerance) -> float:
        """Send ``header text``, and return the number that ``header?`` then answers.

        Raises
        ------
        SettingRefused
            When the instrument holds another number.

        """
        self.port.command(f"{header} {text}")
        reply = self.port.query(f"{header}?")
        got = number_in(reply, f"{self.name}: {header}?")
        if not tolerance.covers(sent, got):
            raise self._refused(header, text, reply)
        return got

    def set_word(self, header: str, sent: str, answers: frozenset[str]) -> None:
        """Send ``header sent``; raises SettingRefused unless ``header?`` gives one of ``answers``."""
        self.port.command(f"{header} {sent}")
        self.expect_word(header, sent, answers)

    def expect_word(self, header: str, sent: str, answers: frozenset[str]) -> None:
        """Raise SettingRefused unless ``header?`` gives one of ``answers`` (upper case)."""
        reply = self.port.query(f"{header}?")
        if reply.strip('"').upper() not in answers:
            raise self._refused(header, sent, reply)

    def _refused(self, header: str, sent: str, got: str) -> SettingRefused:
        return SettingRefused(
            f"{self.name}: {header} was set to {sent} and reads back {got!r}: the instrument took another "
            "value without a word. Stop, check the setting on its panel, and look whether its limits allow it"
        )
