"""What a hardware configuration says of simulated instruments, and the word that lets clients in to them."""

import os
from math import pi, sqrt
from typing import Literal

from pydantic import Field, NonNegativeFloat, PositiveFloat, field_validator

from ..host.toml_file import FrozenModel

TOKEN_KEY = "vibench-token"  # noqa: S105 - a name, not a password
"""Where a gRPC call carries it."""
TOKEN_VARIABLE = "VIBENCH_RIG_TOKEN"  # noqa: S105 - as above
"""Where our own programs find it: the environment, never a command line that others can read."""


def given_token() -> str:
    """Token from the environment; empty where none is needed."""
    return os.environ.get(TOKEN_VARIABLE, "")


USUAL_GRID_RATE_HZ = 102_400.0
"""Steps per second on which the analogue world is computed, unless the configuration says otherwise."""
COARSEST_GRID_RATE_HZ = 12_800.0
"""Coarser, the base would move by 0.8 % less than it should at `WATCHED_HZ`: see `level_error`."""
WATCHED_HZ = 500.0
"""The highest resonance of the specimen, and the top of the paper's sines."""
_MEASURED = 0.55
"""Of `level_error`: against 409.6 thousand steps a second, at 60 Hz to 1 kHz."""
LARGEST_LEVEL_ERROR = 0.01
"""Of a plan that is played on a coarser grid than the usual one."""
STEPS_PER_SAMPLE = 2
"""The least on a coarser grid than the usual one: room for the transition band of the converter's filter."""


class VirtualConfig(FrozenModel):
    """How the simulated rig behaves where a real one just is."""

    seed: int = Field(ge=0)
    pace: Literal["free", "wall"] = "free"
    """``"free"``: as fast as it goes. ``"wall"``: ``speed`` times the clock on the wall."""
    speed: PositiveFloat = 1.0
    grid_rate_hz: float = USUAL_GRID_RATE_HZ
    """Steps per second that are computed: 12.8 to 102.4 kHz, and at least twice the sample rate. A coarser
    grid is faster; see docs/decisions/0006-virtual-rig.md for what it costs."""
    generator_clock_ppm: float = Field(ge=-200, le=200)
    converter_clock_ppm: float = Field(ge=-200, le=200)
    generator_noise_v: NonNegativeFloat
    """White, rms from zero to 25.6 kHz, at the terminal while the output is on [V]."""
    amplifier_noise_v: NonNegativeFloat
    """White, rms in the same band, at the output [V]."""
    accelerometer_noise_m_per_s2: NonNegativeFloat
    """White, rms in the same band [m/s2]."""
    vibrometer_noise_m_per_s_per_rthz: NonNegativeFloat
    vibrometer_dropouts_per_s: NonNegativeFloat
    faults: str | None = None
    """Path of a script of faults to play, from this file's folder on; see docs/faults.md."""
    converter_noise_v: NonNegativeFloat
    """rms of each input at whatever rate it converts [V]."""

    @field_validator("grid_rate_hz")
    @classmethod
    def _is_fine_enough(cls, rate_hz: float) -> float:
        if not COARSEST_GRID_RATE_HZ <= rate_hz <= USUAL_GRID_RATE_HZ:
            raise ValueError(
                f"the virtual rig is computed in {COARSEST_GRID_RATE_HZ:g} to {USUAL_GRID_RATE_HZ:g} steps a "
                f"second: coarser, the base would move by more than "
                f"{level_error(WATCHED_HZ, COARSEST_GRID_RATE_HZ):.1%} too little at {WATCHED_HZ:g} Hz; give "
                "a rate in between, or leave it out"
            )
        return rate_hz


def level_error(frequency_hz: float, grid_rate_hz: float) -> float:
    """By what part the base moves too little in a sine, at most.

    The drive is averaged over a step and held, (pi f h)^2 / 3; the rest is the specimen's force on the
    table, which is extrapolated to the middle of the step. How the specimen answers to the base is exact.
    """
    return _MEASURED * (pi * frequency_hz / grid_rate_hz) ** 2


def highest_carried_hz(grid_rate_hz: float) -> float | None:
    """Give the frequency up to which levels are right on a grid; None on the usual one, which takes all."""
    if grid_rate_hz >= USUAL_GRID_RATE_HZ:
        return None
    return grid_rate_hz / pi * sqrt(LARGEST_LEVEL_ERROR / _MEASURED)


def fastest_sample_rate_hz(grid_rate_hz: float) -> float | None:
    """Give the fastest rate that a converter can have on a grid; None on the usual one, which takes all."""
    return None if grid_rate_hz >= USUAL_GRID_RATE_HZ else grid_rate_hz / STEPS_PER_SAMPLE
