"""Order of the elements of a state vector. SI units."""

import numpy as np
from numpy.typing import NDArray

X, Y, Z, VX, VY, VZ = range(6)
"""Indices of displacements and velocities in a state; the same with and without contact."""


Vector = NDArray[np.float64]
Table = NDArray[np.float64]
Complex = NDArray[np.complex128]
Floats = NDArray[np.float64]
