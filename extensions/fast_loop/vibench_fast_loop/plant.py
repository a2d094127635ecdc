"""Linear equations of amplifier, shaker and specimen between two samples of a controller. SI units."""

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
"""Row numbers of table velocity and m0 displacement in the state of table and specimen."""
SHOWN = 2
"""Number of measured quantities: base acceleration and m0 velocity."""


@dataclass(frozen=True)
class LoopTiming:
    """Sample rate and latency of a real-time controller."""

    rate_hz: float
    """Samples per second; each sample is the mean since the previous sample."""
    latency_s: float
    """Time from a sample to the output of the voltage that the sample determines [s]."""

    def __post_init__(self) -> None:
        if not (0.0 < self.rate_hz < np.inf and 0.0 <= self.latency_s < np.inf):
            raise ValueError(
                f"{self.rate_hz} samples a second, latency {self.latency_s} s: give positive, finite numbers."
            )

    @property
    def step_s(self) -> float:
        """Time between two samples of the controller [s]."""
        return 1.0 / self.rate_hz


@dataclass(frozen=True, eq=False)
class SampledPlant:
    """Discrete-time model of the plant over one control step.

    The state contains the table (displacement, velocity, current), the specimen (x, y, z and velocities), the
    last samples (table velocity, m0 displacement), and the delayed voltages, newest first.
    """

    amplifier: Amplifier
    """Amplifier; its lower band edge is neglected, because it is far below the drive frequency."""
    shaker: Shaker
    specimen: Specimen
    timing: LoopTiming

    @cached_property
    def equations(self) -> tuple[Table, Vector]:
        """System matrix of table and specimen, (9, 9), and effect of one volt at the amplifier, (9,)."""
        table = self.shaker.equations()
        specimen, mass = self.specimen, np.asarray(self.specimen.masses)
        k0, c0 = specimen.stiffnesses[0], specimen.dampings[0]
        rates = block_diag(table.A, np.zeros((6, 6)))
        rates[3:6, 6:9] = np.eye(3)
        rates[6:9, 3:6] = -specimen.stiffness_matrix / mass[:, None]
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
        """Effect of a force between m1 and m2 on the state's rates, and the row that gives p, (n,) each."""
        into, relative = np.zeros(self.size), np.zeros(self.size)
        into[7], into[8] = -1.0 / self.specimen.masses[1], 1.0 / self.specimen.masses[2]
        relative[4], relative[5] = 1.0, -1.0
        return into, relative

    @property
    def waiting(self) -> int:
        """Number of delayed voltages in the state."""
        return ceil(self.timing.latency_s * self.timing.rate_hz * (1.0 - 1e-9))

    @property
    def size(self) -> int:
        """Number of entries in the state vector."""
        return 9 + SHOWN + self.waiting

    @cached_property
    def scales(self) -> Vector:
        """Typical sizes of the state's entries for motions of micrometres, shape (n,)."""
        specimen = [1e-6] * 3 + [1e-3] * 3
        return np.array([1e-6, 1e-3, 1e-2, *specimen, 1e-3, 1e-6, *[1e-2] * self.waiting])

    def stretches(self, parts: int = 1) -> tuple[tuple[Table, Vector], ...]:
        """Return the transitions over a step, which is divided at the middle of each part.

        Each transition is a pair: the state transition, (n, n), and the effect of the new voltage, (n,). The
        force of the stops acts at the divisions (Strang splitting).
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
        """Transition over a whole step: matrix of the state (n, n), and effect of the new voltage (n,)."""
        (first, volt), (second, more) = self.stretches()
        return second @ first, second @ volt + more

    @cached_property
    def sensing(self) -> Table:
        """Matrix for base acceleration and m0 velocity, as means since the last sample, shape (2, n)."""
        rows = np.zeros((SHOWN, self.size))
        rows[0, [TABLE_V, 9]] = self.timing.rate_hz, -self.timing.rate_hz
        rows[1, [M0_X, 10]] = self.timing.rate_hz, -self.timing.rate_hz
        return rows

    def _stretch(self, start_s: float, stop_s: float) -> tuple[Table, Vector]:
        """Return the transition over a part of a step: the oldest delayed voltage acts, then the next."""
        late_s = self.timing.latency_s - max(self.waiting - 1, 0) * self.timing.step_s
        change_s = min(max(late_s, start_s), stop_s)
        matrix, newest = np.eye(self.size), np.zeros(self.size)
        # The list of delayed voltages ends with the oldest voltage; the new voltage precedes the list.
        columns = [*range(11, self.size)][::-1]
        for place, (begin_s, end_s) in enumerate(((start_s, change_s), (change_s, stop_s))):
            moved, gain = _discretise(*self.equations, end_s - begin_s)
            matrix[:9], newest[:9] = moved @ matrix[:9], moved @ newest[:9]
            if place < len(columns):
                matrix[:9, columns[place]] += gain
            else:
                newest[:9] += gain
        return matrix, newest


def _discretise(rates: Table, volts: Vector, length_s: float) -> tuple[Table, Vector]:
    joint = np.zeros((len(volts) + 1, len(volts) + 1))
    joint[:-1, :-1], joint[:-1, -1] = rates * length_s, volts * length_s
    moved = expm(joint)
    return moved[:-1, :-1], moved[:-1, -1]
