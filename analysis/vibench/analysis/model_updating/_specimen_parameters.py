"""What of a specimen can be fitted, by name: read from a specimen, and given to another."""

from collections.abc import Mapping
from dataclasses import replace
from enum import StrEnum
from typing import assert_never

import numpy as np

from vibench.sim import Specimen


class Parameter(StrEnum):
    """What of a specimen is fitted."""

    DAMPING_TIME = "damping_time_s"
    """c_i / k_i, one for all links."""
    F0 = "f0_hz"
    F1 = "f1_hz"
    F2 = "f2_hz"
    """Frequencies of the single oscillators, f_i = sqrt(k_i / m_i) / 2 pi."""
    GAP = "gap_m"


LINEAR = (Parameter.DAMPING_TIME, Parameter.F0, Parameter.F1, Parameter.F2)
"""What a transmission without collisions tells."""


def parameter_value(specimen: Specimen, parameter: Parameter) -> float:
    """Read one parameter of a specimen; the damping time of a specimen with several is that of link 0."""
    masses, stiffnesses = specimen.masses, specimen.stiffnesses
    match parameter:
        case Parameter.DAMPING_TIME:
            return specimen.dampings[0] / stiffnesses[0]
        case Parameter.F0 | Parameter.F1 | Parameter.F2:
            link = LINEAR.index(parameter) - 1
            return float(np.sqrt(stiffnesses[link] / masses[link]) / (2.0 * np.pi))
        case Parameter.GAP:
            return specimen.gap_m
        case _:
            assert_never(parameter)


def with_values(specimen: Specimen, values: Mapping[Parameter, float]) -> Specimen:
    """Give a specimen other parameters; the masses stay, and dampings follow their stiffnesses."""
    beta = values.get(Parameter.DAMPING_TIME, parameter_value(specimen, Parameter.DAMPING_TIME))
    stiffnesses = tuple(
        mass * (2.0 * np.pi * values.get(name, parameter_value(specimen, name))) ** 2
        for mass, name in zip(specimen.masses, LINEAR[1:], strict=True)
    )
    k0, k1, k2 = (float(each) for each in stiffnesses)
    gap_m = values.get(Parameter.GAP, specimen.gap_m)
    return replace(
        specimen,
        stiffnesses=(k0, k1, k2),
        dampings=(beta * k0, beta * k1, beta * k2),
        gap_m=gap_m,
    )
