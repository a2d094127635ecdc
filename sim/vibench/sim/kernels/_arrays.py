"""What the kernels need to know of a specimen: plain numbers, ready to multiply. SI units.

Also the layout of the one state vector that every kernel advances in place.
"""

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Table = NDArray[np.float64]
Complex = NDArray[np.complex128]
Floats = NDArray[np.float64]
