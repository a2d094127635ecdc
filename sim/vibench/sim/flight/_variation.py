"""What a flight makes of a small change: its modes turn and decay, whatever the drive. SI units."""

import cmath

from ..kernels import Complex, Table, inlined
from ..slots import GROWTH, keep_in_range
from ._flight import FlightTables


@inlined
def propagate_tangent_flight(
    tangent: Table, length: float, turned: Complex, phasors: Complex, tables: FlightTables
) -> None:
    """Carry every change over a flight of ``length`` [s], exactly; two workspaces of shape (n+1,)."""
    modes = len(tables.rows)
    for j in range(modes):
        turned[j] = cmath.exp(tables.rates[j] * length)
    for row in range(len(tangent)):
        change = tangent[row]
        for j in range(modes):
            real, imag = 0.0, 0.0
            for i in range(GROWTH):
                real += tables.rows[j, i].real * change[i]
                imag += tables.rows[j, i].imag * change[i]
            phasors[j] = complex(real, imag) * turned[j]
        for i in range(GROWTH):
            value = 0.0
            for j in range(modes):
                shape = tables.shapes[j, i]
                value += phasors[j].real * shape.real - phasors[j].imag * shape.imag
            change[i] = value
        keep_in_range(change)
