"""How far the base will move at each frequency of a plan, as the plan holds it or the rig's model has it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..excitation.base_level import HeldAcceleration, RelativeSetting, RmsSetting
from ..excitation.kinds import Excitation
from ..rig import BaseQuantity, Rig, RigModel
from ._loads import predicted_loads, terminal_volts


@dataclass(frozen=True, eq=False)
class BaseMotion:
    """Amplitude of the base's sine at each frequency."""

    amplitude_m: NDArray[np.float64]
    basis: str
    """Where it comes from."""


def base_motion(excitation: Excitation, rig: Rig, frequency_hz: NDArray[np.float64]) -> BaseMotion:
    """Predict the base's motion, shape of ``frequency_hz``: a level that feedback holds is met exactly.

    A setting is followed through the rig's model, specimen included; noise is stood for by a sine of its rms.
    """
    levels = [excitation.level_at(float(each)) for each in frequency_hz]
    model, terminal_v = RigModel(rig), terminal_volts(excitation, rig)
    amplitudes_m = []
    noise_m: float | None = None
    for level, at_hz in zip(levels, frequency_hz, strict=True):
        match level:
            case HeldAcceleration(acceleration):
                amplitudes_m.append(acceleration / (2 * np.pi * at_hz) ** 2)
            case RelativeSetting(share):
                stroke = model.under_sines(BaseQuantity.STROKE, at_hz, share * terminal_v)
                amplitudes_m.append(abs(complex(stroke)))
            case RmsSetting():
                if noise_m is None:
                    noise_m = np.sqrt(2) * predicted_loads(excitation, rig)[BaseQuantity.STROKE].rms
                amplitudes_m.append(noise_m)
    return BaseMotion(np.array(amplitudes_m, dtype=np.float64), levels[0].basis)
