"""Band-limited white noise from the generator's memory: a random-phase multisine, new for every average."""

from typing import Literal

from pydantic import field_validator

from .multisine import Lines
from .periodic_noise import PeriodicNoise


class WhiteNoise(PeriodicNoise):
    """White noise between two frequencies, as whole periods of flat lines with random phases.

    A periodic signal needs no window and has no leakage, but averaging its periods reduces only the sensors'
    noise. Every realisation therefore has different phases: the average over realisations corresponds to
    noise (Pintelon and Schoukens, System Identification, 2nd ed., section 4.3).
    """

    kind: Literal["white_noise", "multisine_noise"] = "white_noise"
    """``multisine_noise`` is the name of version 0.1; it is read as ``white_noise``."""

    @field_validator("kind")
    @classmethod
    def _present_name(cls, _: str) -> Literal["white_noise"]:
        return "white_noise"

    @property
    def lines(self) -> Lines:
        """All harmonics of ``repetition_hz`` in the band."""
        return self.candidates
