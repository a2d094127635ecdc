"""A simulated rig whose samples are fed to a live twin block by block."""

from concurrent.futures import Executor, Future
from dataclasses import dataclass

import numpy as np

from tests.analysis.hidden_motion import shaken_world
from vibench.acquisition.rig import channels_of
from vibench.analysis.hidden_motion import LiveTwin
from vibench.virtual_rig.world.conversion import Coupling, Input
from vibench.virtual_rig.world.world import World

RATE_HZ = 51_200.0
ROLES = ("base_acceleration", "m0_velocity")


class AtOnce(Executor):
    """Executor that runs each job at once, so that the result of a test does not depend on timing."""

    def submit(self, fn, /, *args, **kwargs):
        future = Future()
        future.set_result(fn(*args, **kwargs))
        return future


@dataclass
class LiveWorld:
    """The simulated rig in motion, and the live twin that tracks it."""

    rig: object
    world: World
    twin: LiveTwin
    conversion: object
    gains: list[tuple[int, float]]
    frequency_hz: float | None
    samples: int = 0

    def go_on(self, samples: int) -> tuple[str, ...]:
        """Feed the next samples to the twin and return its sentences."""
        volts = self.conversion.read(samples)
        base, velocity = (volts[row] * gain for row, gain in self.gains)
        first, self.samples = self.samples, self.samples + samples
        return self.twin.take(first, base, velocity, self.frequency_hz)

    def p(self):
        """Return the true p [m] at every sample so far; clears the stored truth."""
        truth = self.world.truth()
        shaken = shaken_world
        rows = ((np.arange(self.samples) - shaken.GROUP_DELAY) * (shaken.GRID_HZ / RATE_HZ) - 1).astype(int)
        return (truth[:, 4] - truth[:, 5])[np.maximum(rows, 0)]


def live_world(kind, level_vpp, duration_s, seed, known=None, dropouts_per_s=0.0):
    """Start to shake the rig's specimen."""
    rig = shaken_world.noisy(1.0, seed, dropouts_per_s)
    world = World(rig, shaken_world.Played(shaken_world.drive(kind, level_vpp, duration_s, seed)))
    world.keep_truth()
    channels = channels_of(rig)
    inputs = tuple(
        Input(f"{rig.daq.device}/{each.physical}", each.range_v, Coupling(each.coupling), each.iepe_current_a)
        for each in rig.daq.channels
    )
    roles = [each.role.value for each in channels]
    gains = [(roles.index(role), channels[roles.index(role)].units_per_volt) for role in ROLES]
    twin = LiveTwin(rig, RATE_HZ, AtOnce(), known=known)
    played_hz = kind if isinstance(kind, float) else None
    return LiveWorld(rig, world, twin, world.sample(inputs, RATE_HZ), gains, played_hz)
