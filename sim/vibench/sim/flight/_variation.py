"""What a flight makes of a small change: its modes turn and decay, whatever the drive. SI units."""

import cmath

import numpy as np

from ..kernels import Table, kernel
from ..slots import GROWTH, keep_in_range
from ._flight import FlightTables


@kernel
def propagate_tangent_flight(tangent: Table, length: float, tables: FlightTables) -> None:
    """Carry every change over a flight of ``length`` [s], exactly."""
    modes = len(tables.rows)
    turned = np.empty(modes, np.complex128)
    phasors = np.empty(modes, np.complex128)
    for j in range(modes):
        turned[j] = cmath.exp(tables.rates[j] * length)
    for row in range(len(tangent)):
        change = tangent[row]
        for j in range(modes):
            phasor = complex(0.0, 0.0)
            for i in range(GROWTH):
                phasor += tables.rows[j, i] * change[i]
            phasors[j] = phasor * turned[j]
        for i in range(GROWTH):
            value = 0.0
            for j in range(modes):
                value += (phasors[j] * tables.shapes[j, i]).real
            change[i] = value
        keep_in_range(change)
