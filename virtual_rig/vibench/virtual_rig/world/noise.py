"""Noise that depends on its seed, its place and its position only, never on how it is asked for."""

from zlib import crc32

import numpy as np
from numpy.random import Generator, Philox, SeedSequence
from numpy.typing import NDArray

PAGE = 16_384
"""Samples drawn together: a compromise between the cost of a generator and of what is thrown away."""


class NoiseStream:
    """White Gaussian noise of unit variance for one place in the rig.

    A counter-based generator (Salmon et al., Parallel random numbers: as easy as 1, 2, 3, SC11)
    gives any page of the stream directly, so that two runs agree bit for bit whatever block sizes
    they are read in.
    """

    def __init__(self, seed: int, place: str) -> None:
        """``place`` names the stream: streams of different places are independent."""
        self._key = SeedSequence([seed, crc32(place.encode())]).generate_state(2, np.uint64)
        self._page_number = -1
        self._page = np.empty(0)

    def draw(self, first: int, count: int) -> NDArray[np.float64]:
        """Return samples ``first`` to ``first + count - 1`` of the stream, shape (count,)."""
        pages = range(first // PAGE, (first + count - 1) // PAGE + 1)
        if not pages:
            return np.empty(0)
        parts = [self._samples_of(page) for page in pages]
        drawn = parts[0] if len(parts) == 1 else np.concatenate(parts)
        offset = first % PAGE
        return np.asarray(drawn[offset : offset + count])

    def generator(self, page_number: int) -> Generator:
        """Make a random generator for one page: for events rather than samples."""
        # The page counts in the third word: no page can draw enough to reach into the next one.
        return Generator(Philox(key=self._key, counter=np.array([0, 0, page_number, 0], dtype=np.uint64)))

    def _samples_of(self, page_number: int) -> NDArray[np.float64]:
        if page_number != self._page_number:
            self._page = self.generator(page_number).standard_normal(PAGE)
            self._page_number = page_number
        return self._page
