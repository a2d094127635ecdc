"""A digital filter that goes on where its last block ended, in a compiled loop: blocks are short here."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibench.sim.kernels import kernel

FloatArray = NDArray[np.float64]


class FilterParts(NamedTuple):
    """Weights and memory of a filter."""

    numerator: FloatArray
    denominator: FloatArray
    state: FloatArray


class RecursiveFilter:
    """A ratio of polynomials in the delay by one step (direct form II, transposed), at rest to begin with."""

    def __init__(self, numerator: ArrayLike, denominator: ArrayLike) -> None:
        """Take the weights of the present value first; the denominator begins with 1."""
        weights = [np.asarray(each, dtype=np.float64) for each in (numerator, denominator)]
        order = max(len(each) for each in weights)
        self._numerator, self._denominator = (np.pad(each, (0, order - len(each))) for each in weights)
        self._state = np.zeros(order)

    def run(self, values: FloatArray) -> FloatArray:
        """Return the next output values, one for each input value."""
        result = np.empty(len(values))
        run_filter(self.parts, values, result)
        return result

    @property
    def parts(self) -> FilterParts:
        """What a compiled loop around it runs."""
        return FilterParts(self._numerator, self._denominator, self._state)


@kernel
def run_filter(parts: FilterParts, values: FloatArray, result: FloatArray) -> None:
    """Filter ``values`` into ``result``; the last element of the state stays zero."""
    numerator, denominator, state = parts
    for n in range(values.size):
        value = values[n]
        shown = state[0] + numerator[0] * value
        for k in range(1, numerator.size):
            state[k - 1] = state[k] + numerator[k] * value - denominator[k] * shown
        result[n] = shown
