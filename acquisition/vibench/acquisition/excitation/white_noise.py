"""Band-limited white noise from the generator's memory: a random-phase multisine for every realisation."""

from typing import Literal

from pydantic import field_validator

from .periodic_noise import PeriodicNoise


class WhiteNoise(PeriodicNoise):
    """White noise between two frequencies: periods of a multisine with equal amplitudes and random phases.

    A periodic signal needs no window and has no leakage, but averaging over its periods reduces only the
    sensor noise. Every realisation therefore has new phases; averaging over realisations acts like averaging
    of noise (Pintelon and Schoukens, System Identification, 2nd ed., section 4.3).
    """

    kind: Literal["white_noise", "multisine_noise"] = "white_noise"
    """``multisine_noise``, the name of this kind in version 0.1, is read as ``white_noise``."""

    @field_validator("kind")
    @classmethod
    def _present_name(cls, _: str) -> Literal["white_noise"]:
        return "white_noise"
