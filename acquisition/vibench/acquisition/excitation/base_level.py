"""What decides how far the base moves at a frequency: a level that is held, or a setting of the generator."""

from dataclasses import dataclass
from typing import ClassVar, TypeAlias


@dataclass(frozen=True)
class HeldAcceleration:
    """Feedback holds the base's fundamental, whatever setting that takes."""

    amplitude_m_per_s2: float
    """Peak."""
    basis: ClassVar[str] = "the level that feedback holds"


@dataclass(frozen=True)
class RelativeSetting:
    """A sine at a setting: the base does what the shaker makes of it."""

    share: float
    """Of the plan's ``amplitude_vpp``."""
    basis: ClassVar[str] = "the rig's linear model"


@dataclass(frozen=True)
class RmsSetting:
    """Noise at the plan's setting: no sine is played, so that one of the same rms stands for it."""

    basis: ClassVar[str] = "a sine of the same rms base displacement"


LevelAtBase: TypeAlias = HeldAcceleration | RelativeSetting | RmsSetting
