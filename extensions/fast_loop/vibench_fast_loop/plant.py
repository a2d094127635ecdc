"""Amplifier, shaker and specimen between two samples of a controller, as linear equations. SI units."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import ceil

import numpy as np
from scipy.linalg import block_diag, expm

from vibench.sim.shaker.loaded_shaker import Amplifier, Shaker
from vibench.sim.specimen.specimen import Specimen
from vibench.sim.specimen.state import Table, Vector

TABLE_V, M0_X = 1, 3
"""Rows of the table's velocity and of m0's displacement in the state of table and specimen."""
SHOWN = 2
"""Base acceleration and m0 velocity."""


@dataclass(frozen=True)
class LoopTiming:
    """When a controller samples, and when what it sampled is answered."""

    rate_hz: float
    """Samples a second; each is the mean since the one before."""
    latency_s: float
    """Latency from a sample to the voltage that depends on it [s]."""

    def __post_init__(self) -> None:
        if not (0.0 < self.rate_hz < np.inf and 0.0 <= self.latency_s < np.inf):
            msg = f"{self.rate_hz} samples a second, {self.latency_s} s of latency are not allowed: positive."
            raise ValueError(msg)

    @property
    def step_s(self) -> float:
        """Time between two samples [s]."""
        return 1.0 / self.rate_hz


@dataclass(frozen=True, eq=False)
class SampledPlant:
    """What one step of a controller makes of everything that it drives.

    Its state: table (displacement, velocity, current), specimen (x, y, z and velocities), what was sampled
    last (table velocity, m0 displacement), and the volts that are on their way, newest first.
    """

    amplifier: Amplifier
    """Its lower band edge is left out: it lies far below what is held."""
    shaker: Shaker
    specimen: Specimen
    timing: LoopTiming
    stiffness: float = 0.0
    """Added to the spring between m1 and m2: what a motion makes of the stops on average [N/m]."""

    @cached_property
    def equations(self) -> tuple[Table, Vector]:
        """Rates of table and specimen, shape (9, 9), and what a volt at the amplifier's input adds, (9,)."""
        table = self.shaker.equations()
        specimen, mass = self.specimen, np.asarray(self.specimen.masses)
        along = np.array([0.0, 1.0, -1.0])
        spring = specimen.stiffness_matrix + self.stiffness * np.outer(along, along)
        k0, c0 = specimen.stiffnesses[0], specimen.dampings[0]
        rates = block_diag(table.A, np.zeros((6, 6)))
        rates[3:6, 6:9] = np.eye(3)
        rates[6:9, 3:6] = -spring / mass[:, None]
        rates[6:9, 6:9] = -specimen.damping_matrix / mass[:, None]
        rates[6, 0] += k0 / mass[0]
        rates[6, 1] += c0 / mass[0]
        push = table.B[:, 1]
        rates[:3, 0] -= k0 * push
        rates[:3, 1] -= c0 * push
        rates[:3, 3] += k0 * push
        rates[:3, 6] += c0 * push
        return rates, np.append(self.amplifier.gain * table.B[:, 0], np.zeros(6))

    @cached_property
    def spring(self) -> tuple[Vector, Vector]:
        """What a force between m1 and m2 adds to the rates of the whole state, and p in it, (n,) each."""
        into, relative = np.zeros(self.size), np.zeros(self.size)
        into[7], into[8] = -1.0 / self.specimen.masses[1], 1.0 / self.specimen.masses[2]
        relative[4], relative[5] = 1.0, -1.0
        return into, relative

    @property
    def waiting(self) -> int:
        """Volts on their way."""
        return ceil(self.timing.latency_s * self.timing.rate_hz * (1.0 - 1e-9))

    @property
    def size(self) -> int:
        """Numbers in the state."""
        return 9 + SHOWN + self.waiting

    @cached_property
    def scales(self) -> Vector:
        """Sizes of the state's parts in motions of micrometres, shape (n,)."""
        specimen = [1e-6] * 3 + [1e-3] * 3
        return np.array([1e-6, 1e-3, 1e-2, *specimen, 1e-3, 1e-6, *[1e-2] * self.waiting])

    def stretches(self, parts: int = 1) -> tuple[tuple[Table, Vector], ...]:
        """Give the stretches of a step between the middles of its parts, ends included, one more than parts.

        Each is state before to state after, (n, n), and what the new volt adds, (n,). The spring between m1
        and m2 acts between them (Strang splitting).
        """
        step, size = self.timing.step_s, self.size
        sampled = np.eye(size)
        sampled[9:11] = np.eye(size)[[TABLE_V, M0_X]]
        moved_on, newest = np.eye(size), np.zeros(size)
        moved_on[11:] = np.eye(size)[10 : size - 1]
        if self.waiting:
            moved_on[11] = 0.0
            newest[11] = 1.0
        edges = step / parts * np.array([0.0, *(np.arange(parts) + 0.5), parts])
        found = [self._stretch(*each) for each in pairwise(edges)]
        found[0] = found[0][0] @ sampled, found[0][1]
        found[-1] = moved_on @ found[-1][0], moved_on @ found[-1][1] + newest
        return tuple(found)

    @cached_property
    def step(self) -> tuple[Table, Vector]:
        """State and new volt before to the state after a whole step, shapes (n, n) and (n,)."""
        (first, volt), (second, more) = self.stretches()
        return second @ first, second @ volt + more

    @cached_property
    def shown(self) -> Table:
        """Base acceleration and m0 velocity of a state, means since the last sample, shape (2, n)."""
        rows = np.zeros((SHOWN, self.size))
        rows[0, [TABLE_V, 9]] = self.timing.rate_hz, -self.timing.rate_hz
        rows[1, [M0_X, 10]] = self.timing.rate_hz, -self.timing.rate_hz
        return rows

    def _stretch(self, start_s: float, stop_s: float) -> tuple[Table, Vector]:
        """Move table and specimen through a part of a step, under the oldest volt and then the next."""
        late_s = self.timing.latency_s - max(self.waiting - 1, 0) * self.timing.step_s
        change_s = min(max(late_s, start_s), stop_s)
        matrix, newest = np.eye(self.size), np.zeros(self.size)
        # The volts on their way end with the oldest; the newest, which this step begins, comes before them.
        columns = [*range(11, self.size)][::-1]
        for place, (begin_s, end_s) in enumerate(((start_s, change_s), (change_s, stop_s))):
            moved, gain = _driven(*self.equations, end_s - begin_s)
            matrix[:9], newest[:9] = moved @ matrix[:9], moved @ newest[:9]
            if place < len(columns):
                matrix[:9, columns[place]] += gain
            else:
                newest[:9] += gain
        return matrix, newest


def _driven(rates: Table, volts: Vector, length_s: float) -> tuple[Table, Vector]:
    joint = np.zeros((len(volts) + 1, len(volts) + 1))
    joint[:-1, :-1], joint[:-1, -1] = rates * length_s, volts * length_s
    moved = expm(joint)
    return moved[:-1, :-1], moved[:-1, -1]
