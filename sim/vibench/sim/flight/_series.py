"""Flight as a Taylor series in time: the exact motion over a short stretch, at any instant. SI units."""

from ..kernels import Table, Vector, kernel_without_refcount
from ..model import VX, VY, VZ, X, Y, Z
from ..slots import Parameters
from ._base_force import Cubic
from ._detection import SERIES_TERMS


@kernel_without_refcount
def fill_flight_series(series: Table, path: Vector, state: Vector, force: Cubic, par: Parameters) -> None:
    """Write the coefficients of the motion to ``series`` (terms, 6) and those of p to ``path`` (terms,).

    Each coefficient follows from the one before by the equations of motion; the base force is a cubic.
    """
    for i in range(6):
        series[0, i] = state[i]
    path[0] = state[Y] - state[Z]
    for k in range(SERIES_TERMS - 1):
        x, y, z = series[k, X], series[k, Y], series[k, Z]
        vx, vy, vz = series[k, VX], series[k, VY], series[k, VZ]
        push = force[k] if k < 4 else 0.0
        pull = par.k2 * (z - x) + par.c2 * (vz - vx)
        hold = par.k1 * (y - z) + par.c1 * (vy - vz)
        share = 1.0 / (k + 1)
        series[k + 1, X] = share * vx
        series[k + 1, Y] = share * vy
        series[k + 1, Z] = share * vz
        series[k + 1, VX] = share * (pull + push - par.k0 * x - par.c0 * vx) / par.mass0
        series[k + 1, VY] = share * -hold / par.mass1
        series[k + 1, VZ] = share * (hold - pull) / par.mass2
        path[k + 1] = share * (vy - vz)


@kernel_without_refcount
def place_on_series(state: Vector, series: Table, tau: float) -> None:
    """Set the motion of ``state`` to that of the series at ``tau``."""
    for i in range(6):
        value = series[SERIES_TERMS - 1, i]
        for k in range(SERIES_TERMS - 2, -1, -1):
            value = value * tau + series[k, i]
        state[i] = value
