"""A digital filter that goes on where its last block ended."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vibench.sim.engine.run import native_engine
from vibench.sim.engine.structures import Structure

FloatArray = NDArray[np.float64]


class RecursiveFilter:
    """A ratio of polynomials in the delay by one step (direct form II, transposed), at rest to begin with."""

    def __init__(self, numerator: ArrayLike, denominator: ArrayLike) -> None:
        """Take the weights of the present value first; the denominator begins with 1."""
        weights = [np.asarray(each, dtype=np.float64) for each in (numerator, denominator)]
        order = max(len(each) for each in weights)
        self.numerator, self.denominator = (np.pad(each, (0, order - len(each))) for each in weights)
        self.parts: Structure = native_engine().new(
            "RecursiveFilter",
            numerator=self.numerator,
            denominator=self.denominator,
            state=np.zeros(order),
        )
        """What the native engine runs."""

    def run(self, values: FloatArray) -> FloatArray:
        """Return the next output values, one for each input value."""
        engine, result = native_engine(), np.empty(len(values))
        engine.call(
            "filter_signal", engine.new("FilteredSignal", filter=self.parts, values=values, result=result)
        )
        return result
