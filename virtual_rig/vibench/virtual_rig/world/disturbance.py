"""Stretches in which a sensor shows something else than it should: drawn at random, or on demand."""

from dataclasses import dataclass
from zlib import crc32

import numpy as np
from numpy.random import Generator, Philox, SeedSequence
from numpy.typing import NDArray

from .time_grid import USUAL_GRID, TimeGrid

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


@dataclass(frozen=True)
class Disturbance:
    """The output is held at a level from one step to another."""

    first_step: int
    stop_step: int
    """The first step after it."""
    level: float
    """Part of full scale, -1 to 1."""


class RandomDropouts:
    """Moments at which speckle leaves the laser without light: a Poisson process in time.

    The decoder then follows noise instead of a carrier. Each dropout holds an arbitrary level for an
    exponentially distributed time.
    """

    MEAN_S = 30.0 / 102_400
    """Mean length, about 0.3 ms; assumed."""

    def __init__(self, per_s: float, stream: NoiseStream, grid: TimeGrid = USUAL_GRID) -> None:
        """``per_s`` is the expected number of dropouts in a second."""
        self._per_page = per_s * grid.step_s * PAGE
        self._mean_steps = self.MEAN_S * grid.rate_hz
        self._stream = stream

    def between(self, first: int, stop: int) -> list[Disturbance]:
        """Every dropout that reaches into the steps from ``first`` to before ``stop``."""
        if self._per_page == 0.0:
            return []
        # None is longer than a page, so the page before is as far back as one can begin.
        pages = range(max(first // PAGE - 1, 0), stop // PAGE + 1)
        found = [dropout for page in pages for dropout in self._of(page)]
        return [dropout for dropout in found if dropout.stop_step > first and dropout.first_step < stop]

    def _of(self, page: int) -> list[Disturbance]:
        random = self._stream.generator(page)
        count = int(random.poisson(self._per_page))
        begins = page * PAGE + random.integers(0, PAGE, count)
        lengths = np.minimum(np.ceil(random.exponential(self._mean_steps, count)), PAGE).astype(np.int64)
        levels = random.uniform(-1.0, 1.0, count)
        return [
            Disturbance(int(begin), int(begin + length), float(level))
            for begin, length, level in zip(begins, lengths, levels, strict=True)
        ]


def overwrite(
    values: NDArray[np.float64], first_step: int, full_scale: float, disturbances: list[Disturbance]
) -> None:
    """Put the disturbances into ``values``, whose first belongs to ``first_step``, in place."""
    for disturbance in disturbances:
        begin = max(disturbance.first_step - first_step, 0)
        stop = max(disturbance.stop_step - first_step, 0)
        values[begin:stop] = disturbance.level * full_scale
