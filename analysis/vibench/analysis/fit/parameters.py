"""Parameters of a specimen that can be fitted to linear motion."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import ClassVar, assert_never

import numpy as np

from vibench.sim import Specimen

from ..tables import unit_of


class Parameter(StrEnum):
    """Parameter of a specimen."""

    DAMPING_TIME = "damping_time_s"
    """Damping time c_i / k_i, common to all links."""
    F0 = "f0_hz"
    F1 = "f1_hz"
    F2 = "f2_hz"
    """Frequencies of the single oscillators, f_i = sqrt(k_i / m_i) / 2 pi."""
    M0 = "m0_kg"
    M1 = "m1_kg"
    M2 = "m2_kg"
    """Masses; only one can be fitted at a time, because motion determines only their ratios."""
    C0 = "c0_ns_per_m"
    C1 = "c1_ns_per_m"
    C2 = "c2_ns_per_m"
    """Individual dampers, independent of the common damping time."""
    GAP = "gap_m"


LINEAR = (Parameter.DAMPING_TIME, Parameter.F0, Parameter.F1, Parameter.F2)
"""Parameters fitted by default to a transmission without collisions."""
MASSES = (Parameter.M0, Parameter.M1, Parameter.M2)
DAMPERS = (Parameter.C0, Parameter.C1, Parameter.C2)
ALSO_FREE = MASSES + DAMPERS
"""Parameters that may be fitted in addition."""
SHOWN = {
    Parameter.DAMPING_TIME: ("c / k", 1e6, "µs"),
    Parameter.F0: ("f0", 1.0, "Hz"),
    Parameter.F1: ("f1", 1.0, "Hz"),
    Parameter.F2: ("f2", 1.0, "Hz"),
    Parameter.M0: ("m0", 1e3, "g"),
    Parameter.M1: ("m1", 1e3, "g"),
    Parameter.M2: ("m2", 1e3, "g"),
    Parameter.C0: ("c0", 1.0, "N s/m"),
    Parameter.C1: ("c1", 1.0, "N s/m"),
    Parameter.C2: ("c2", 1.0, "N s/m"),
    Parameter.GAP: ("gap of the nearer side", 1e6, "µm"),
}
"""Name, factor from SI units, and unit of each parameter in texts."""


@dataclass(frozen=True)
class FittedValue:
    """A fitted parameter with its interval."""

    OWN_UNITS: ClassVar = dict.fromkeys(("value", "low", "high", "sd", "nominal"), "{0.unit}")
    DOCUMENT: ClassVar = "value low high sd bench=nominal"

    parameter: Parameter
    value: float
    low: float
    high: float
    """Bounds at the confidence level of the fit."""
    sd: float
    """Standard deviation; NaN if only bounds are known."""
    nominal: float
    """Value of the parameter in the bench configuration."""

    @property
    def unit(self) -> str:
        """Unit of the values, SI."""
        return unit_of(self.parameter)


def parameter_value(specimen: Specimen, parameter: Parameter) -> float:
    """Return the value of a parameter; for the damping time, the value of link 0 (the others may differ)."""
    masses, stiffnesses = specimen.masses, specimen.stiffnesses
    match parameter:
        case Parameter.DAMPING_TIME:
            return specimen.dampings[0] / stiffnesses[0]
        case Parameter.F0 | Parameter.F1 | Parameter.F2:
            link = LINEAR.index(parameter) - 1
            return float(np.sqrt(stiffnesses[link] / masses[link]) / (2.0 * np.pi))
        case Parameter.M0 | Parameter.M1 | Parameter.M2:
            return masses[MASSES.index(parameter)]
        case Parameter.C0 | Parameter.C1 | Parameter.C2:
            return specimen.dampings[DAMPERS.index(parameter)]
        case Parameter.GAP:
            return min(specimen.gaps_m)
        case _:
            assert_never(parameter)


def with_values(specimen: Specimen, values: Mapping[Parameter, float]) -> Specimen:
    """Return a specimen with changed parameters; a changed mass leaves the frequencies unchanged.

    Dampers that are not given stay proportional to stiffness, and the ratio of the two gaps is kept.
    """
    old = parameter_value(specimen, Parameter.DAMPING_TIME)
    beta = values.get(Parameter.DAMPING_TIME, old)
    shares = [
        c / k / old if old else 1.0 for c, k in zip(specimen.dampings, specimen.stiffnesses, strict=True)
    ]
    m0, m1, m2 = masses = tuple(values.get(each, parameter_value(specimen, each)) for each in MASSES)
    k0, k1, k2 = stiffnesses = [
        mass * (2.0 * np.pi * values.get(name, parameter_value(specimen, name))) ** 2
        for mass, name in zip(masses, LINEAR[1:], strict=True)
    ]
    c0, c1, c2 = (
        values.get(each, share * beta * k)
        for each, share, k in zip(DAMPERS, shares, stiffnesses, strict=True)
    )
    nearest = min(specimen.gaps_m)
    wider = values.get(Parameter.GAP, nearest) / nearest
    lower, upper = specimen.gaps_m
    return replace(
        specimen,
        masses=(m0, m1, m2),
        stiffnesses=(k0, k1, k2),
        dampings=(c0, c1, c2),
        gap_m=wider * upper,
        lower_gap_m=None if specimen.lower_gap_m is None else wider * lower,
    )
