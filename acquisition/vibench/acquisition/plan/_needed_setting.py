"""The generator's setting that a level of the base needs, by the rig's linear model."""

from ..rig import Quantity, Rig, RigModel


def needed_vpp(rig: Rig, acceleration: float, frequency_hz: float) -> float:
    """Give the setting, peak to peak [V], at which the base's acceleration has an amplitude [m/s2].

    The specimen is not in the model: where it pushes back, more or less is needed.
    """
    per_volt = abs(complex(RigModel(rig).transfer(Quantity.ACCELERATION, frequency_hz)))
    return 2 * acceleration / (per_volt * rig.generator.terminal_factor())
