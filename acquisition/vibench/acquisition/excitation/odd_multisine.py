"""A multisine that separates even from odd nonlinearity.
It excites only odd spectral lines, and leaves some of them out as detection lines.
"""

from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, PositiveInt, model_validator

from .multisine import Lines
from .periodic_noise import MOST_REALISATIONS, PeriodicNoise

GROUP = 4
"""Number of adjacent odd lines of which one, chosen at random, is a detection line."""
DETECTION_KEY = 0x0DD
"""Key of the random numbers for the detection lines, which are independent of the random phases."""


class OddMultisine(PeriodicNoise):
    """An odd random-phase multisine with random detection lines.

    Even nonlinearities appear on the even lines, odd ones on the odd detection lines. The drive has no power
    on these lines (Pintelon and Schoukens, System Identification, 2nd ed., section 4.3).
    """

    kind: Literal["odd_multisine"] = "odd_multisine"
    realisations: Annotated[int, Field(gt=0, le=MOST_REALISATIONS)] = 7
    """Number of waveforms; all have the same spectral lines, each with different phases."""
    excited_lines: tuple[PositiveInt, ...] = ()
    """Harmonics of ``repetition_hz`` that are excited; if empty, the seed determines a random choice."""
    detection_lines: tuple[PositiveInt, ...] = ()
    """Odd harmonics that are left out; if empty, these are all odd lines of the band that are not excited."""

    @model_validator(mode="after")
    def _lines_fit_the_band(self) -> Self:
        odd = [int(line) for line in self.candidates]
        left_out = self._detection_lines()
        excited = self.excited_lines or tuple(line for line in odd if line not in left_out)
        strangers = sorted(set(excited) - set(odd))
        if strangers:
            raise ValueError(
                f"excited_lines has {strangers[0]}, which is not an odd harmonic in the band; "
                f"give odd lines from {odd[0]} to {odd[-1]}, or leave excited_lines out for a random choice"
            )
        silent = tuple(sorted(set(odd) - set(excited)))
        if self.detection_lines not in ((), silent):
            raise ValueError(
                "detection_lines must be the odd lines of the band that are not excited; "
                "leave detection_lines out to use these"
            )
        # Store the chosen lines in the plan, so that other programs can read them from its file.
        object.__setattr__(self, "excited_lines", tuple(sorted(excited)))
        object.__setattr__(self, "detection_lines", silent)
        return self

    @property
    def candidates(self) -> Lines:
        """The odd harmonics of ``repetition_hz`` in the band."""
        lines = super().candidates
        return np.asarray(lines[lines % 2 == 1], dtype=np.int64)

    @property
    def lines(self) -> Lines:
        """The odd harmonics of ``repetition_hz`` that are excited."""
        return np.array(self.excited_lines, dtype=np.int64)

    def _detection_lines(self) -> set[int]:
        random = np.random.Generator(
            np.random.PCG64(np.random.SeedSequence(self.seed, spawn_key=(DETECTION_KEY,)))
        )
        lines = self.candidates
        whole_groups = lines[: len(lines) // GROUP * GROUP].reshape(-1, GROUP)
        chosen = np.floor(random.random(len(whole_groups)) * GROUP).astype(np.int64)
        return {int(group[place]) for group, place in zip(whole_groups, chosen, strict=True)}
