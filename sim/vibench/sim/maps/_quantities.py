"""What may vary in a map: a row for each quantity, with its field, its axis and its place in a scene."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Quantity:
    """One number of a scene that may be fixed or vary."""

    field: str
    """Of `Map`."""
    axis: str
    """Of the results."""
    units: str
    long_name: str


DRIVE = (
    Quantity("frequency_hz", "frequency", "Hz", "drive frequency"),
    Quantity("amplitude_m", "amplitude", "m", "amplitude of the base displacement"),
)
OF_SPECIMEN = (
    Quantity("gap_m", "gap", "m", "clearance at both stops"),
    Quantity("damping_time_s", "damping_time", "s", "damping over stiffness of every link"),
    Quantity("k0_n_per_m", "k0", "N m-1", "stiffness between base and m0"),
    Quantity("k1_n_per_m", "k1", "N m-1", "stiffness between m2 and m1"),
    Quantity("k2_n_per_m", "k2", "N m-1", "stiffness between m0 and m2"),
    Quantity("hertz_stiffness", "hertz_stiffness", "N m-1.5", "stiffness of the stops"),
)
START = tuple(
    Quantity(
        f"{symbol}{mass}_{suffix}", f"{symbol}{mass}", units, f"{what} of m{'xyz'.index(mass)} at the start"
    )
    for symbol, suffix, units, what in (("", "m", "m", "displacement"), ("v", "m_per_s", "m s-1", "velocity"))
    for mass in "xyz"
)
QUANTITIES = (*DRIVE, *OF_SPECIMEN, *START)
