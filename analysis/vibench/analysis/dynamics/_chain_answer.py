"""An answer on chains: what follows without contact, and what every run came to, cell by cell."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from vibench.sim import Outcome
from vibench.sim.chain import (
    BandGap,
    band_frequencies_hz,
    band_gaps,
    bloch_factor,
    chain_transmissibility,
)

from ..signals.arrays import Reals
from ..tables import Labelled, named, plain
from ._chain_request import ChainRequest

WAVES = 61
"""Wave numbers at which bands are drawn, from 0 to pi."""
LINES = 800
"""Frequencies at which a transmissibility without contact is drawn."""
MOST_SHOWN = 4
"""Cells of one chain whose transmission is drawn."""
ABOVE_BANDS = 1.15
"""... up to this many times the highest band."""
REACHED = Outcome.REACHED_END.text
DECIBELS = 20.0 / math.log(10.0)


@dataclass(frozen=True, eq=False)
class ChainRun(Labelled):
    """One chain under one drive; arrays by cell, counted from the base."""

    cells: int
    frequency_hz: float
    """Of a steady sine; NaN otherwise."""
    over_hz: Reals
    """Frequencies of the transmission, shape (m,): one under a steady sine."""
    transmission: Reals
    """|x of m0 at that frequency| over the base's, shape (m, cells)."""
    largest_m: Reals
    """Largest |p| = |y - z| of every cell while observed, shape (cells,)."""
    impacts: NDArray[np.int64]
    """Contacts that began while observed, shape (cells,)."""
    observed_s: float
    energy_j: Reals
    """Mean energy of every cell: masses, springs with the link to the cell before, stops; shape (cells,)."""
    energy_error_j: Reals
    """Standard error of that mean."""
    exponent_per_s: float
    """Largest Lyapunov exponent; NaN where it was not asked for."""
    exponent_error_per_s: float
    time_s: Reals
    """Of the picture, shape (n,)."""
    motion_m: Reals
    """x of m0 in every cell over the last periods of a steady sine; under other drives its root mean square
    in equal stretches; shape (n, cells)."""
    impact_time_s: Reals
    """Contacts that began in the time of the picture."""
    impact_cell: NDArray[np.int64]
    outcome: str
    elapsed_s: float

    def to_dict(self) -> dict[str, object]:
        """Say everything but the picture; numbers that are not finite are null."""
        document = {
            **named(self, "cells", "frequency_hz", "over_hz", "transmission", "impacts", "observed_s"),
            **named(self, "energy_j", "energy_error_j", "outcome", "elapsed_s"),
            "largest_p_m": self.largest_m,
            "lyapunov_per_s": self.exponent_per_s,
            "lyapunov_error_per_s": self.exponent_error_per_s,
        }
        return dict(plain(document))


@dataclass(frozen=True, eq=False)
class ChainAnswer(Labelled):
    """Everything that was computed for one request."""

    OWN_UNITS: ClassVar = {"wave_numbers": "rad"}

    request: ChainRequest
    runs: tuple[ChainRun, ...]
    elapsed_s: float

    @cached_property
    def gaps(self) -> tuple[BandGap, ...]:
        """Of the endless chain without damping and contact."""
        return band_gaps(self.request.unit)

    @cached_property
    def bands_hz(self) -> Reals:
        """Frequencies of undamped waves at `wave_numbers`, shape (WAVES, 3 x cells of the unit)."""
        return band_frequencies_hz(self.request.unit, self.wave_numbers)

    @property
    def wave_numbers(self) -> Reals:
        """Phase from unit to unit [rad]."""
        return np.linspace(0.0, np.pi, WAVES)

    @cached_property
    def linear_hz(self) -> Reals:
        """Frequencies of what is drawn without contact; denser where a peak is."""
        top = ABOVE_BANDS * float(self.bands_hz.max())
        return np.linspace(top / LINES, top, LINES)

    def linear_transmission(self, cells: int) -> Reals:
        """|x of m0 over U| without contact, at `linear_hz`, shape (LINES, cells)."""
        return np.asarray(np.abs(chain_transmissibility(self.request.chain(cells), self.linear_hz)[:, :, 0]))

    @cached_property
    def attenuation_db(self) -> Reals:
        """By how much a wave of the endless damped chain decays from unit to unit, at `linear_hz` [dB]."""
        return np.asarray(-DECIBELS * np.log(np.abs(bloch_factor(self.request.unit, self.linear_hz))))

    @property
    def shown_cells(self) -> tuple[tuple[int, int, str], ...]:
        """Length, place and name of cells to draw: the last of every chain, or a few of the only one."""
        lengths = self.request.lengths
        if len(lengths) > 1:
            return tuple((cells, cells - 1, f"{cells} cells: last") for cells in lengths)
        (cells,) = lengths
        places = np.unique(np.linspace(0, cells - 1, min(cells, MOST_SHOWN)).round().astype(int))
        return tuple((cells, int(place), f"cell {place + 1}") for place in places)

    @property
    def shown_run(self) -> ChainRun | None:
        """The last run that reached its end: its motion, energies and impacts are drawn."""
        return next((run for run in reversed(self.runs) if run.outcome == REACHED), None)

    def driven_transmission(self, cells: int, place: int) -> tuple[Reals, Reals]:
        """Frequencies and transmissions of all runs of a chain at one cell, in the order of the runs."""
        runs = [run for run in self.runs if run.cells == cells]
        if not runs:
            return np.zeros(0), np.zeros(0)
        over_hz = np.concatenate([run.over_hz for run in runs])
        return over_hz, np.concatenate([run.transmission[:, place] for run in runs])

    @property
    def cost_sentence(self) -> str:
        """Say what was found and what it cost."""
        gaps = ", ".join(
            f"{gap.lower_hz:.4g} Hz and above"
            if math.isinf(gap.upper_hz)
            else f"{gap.lower_hz:.4g} to {gap.upper_hz:.4g} Hz"
            for gap in self.gaps
        )
        said = f"Gaps of the endless chain: {gaps}."
        if not self.runs:
            return said
        impacts = sum(int(run.impacts.sum()) for run in self.runs)
        lost = sum(run.outcome != REACHED for run in self.runs)
        complaint = f"; {lost} did not reach their end" if lost else ""
        return (
            f"{said} {len(self.runs)} runs in {self.elapsed_s:.1f} s, {impacts} impacts observed; contacts "
            f"to {self.request.accuracy.promise:g} of 100 µm and 0.1 m/s{complaint}."
        )

    def to_dict(self) -> dict[str, object]:
        """Say everything, for other programs."""
        return {
            "options": self.request.model_dump(mode="json"),
            "gaps_hz": [[gap.lower_hz, plain(gap.upper_hz)] for gap in self.gaps],
            "wave_numbers_rad": self.wave_numbers.tolist(),
            "bands_hz": self.bands_hz.T.tolist(),
            "linear_hz": self.linear_hz.tolist(),
            "attenuation_db_per_unit": self.attenuation_db.tolist(),
            "linear_transmission": {
                str(cells): self.linear_transmission(cells).T.tolist() for cells in self.request.lengths
            },
            "runs": [run.to_dict() for run in self.runs],
            "elapsed_s": self.elapsed_s,
        }
