"""Compiling the world before anybody waits for it: a call over gRPC that compiles may pass its deadline."""

import numpy as np
from numpy.typing import NDArray

from vibench.acquisition.instruments import LoopProgram, LoopRequest
from vibench.acquisition.rig import Rig

from ..analogue import Coupling, Input
from ..controller import controller_of
from ._world import World, virtual_section

_SAMPLES = 16
_STEPS_PER_SAMPLE = 4
_warmed_up: set[tuple[str, bool]] = set()
"""Contact laws, with a fast loop or without, whose kernels this process has: they decide what is compiled."""


class _Silence:
    """A terminal at which nothing is connected."""

    def render(self, start_s: float, interval_s: float, count: int) -> NDArray[np.float64]:  # noqa: ARG002
        """Return zeros."""
        return np.zeros(count)


def warm_up(rig: Rig) -> None:
    """Compile what a rig will run, or read it from the cache; once in a process, in a world of its own."""
    compiled = rig.specimen.contact, rig.controller is not None
    if compiled in _warmed_up:
        return
    inputs = tuple(
        Input(f"{rig.daq.device}/{each.physical}", each.range_v, Coupling(each.coupling), each.iepe_current_a)
        for each in rig.daq.channels
    )
    loop = controller_of(rig, lambda: 0.0)
    world = World(rig, _Silence(), loop=loop)
    running = world.sample(inputs, virtual_section(rig).grid_rate_hz / _STEPS_PER_SAMPLE)
    running.read(_SAMPLES)
    if loop is not None:
        program = LoopProgram(frequency_hz=100.0, reference_v=((0.0, 0.0),))
        loop.execute(LoopRequest(ask="play", program=program).model_dump_json().encode())
        running.read(_SAMPLES)
    _warmed_up.add(compiled)
