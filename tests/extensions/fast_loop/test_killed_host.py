"""The watchdog of the controller silences it when the process that uses it is killed."""

import subprocess
import sys

import numpy as np
import pytest

from vibench.acquisition.rig import ControllerConfig, load_rig
from vibench.virtual_rig import VirtualRig
from vibench.virtual_rig.world.conversion import Coupling, Input

HOST = """
import sys
from vibench.acquisition.instruments import PlugInKind, plug_in
from vibench.acquisition.rig import ControllerConfig
from vibench_fast_loop.protocol import LoopProgram
config = ControllerConfig(resource=sys.argv[1], rate_hz=10_240, latency_s=3e-4, limit_v=2, source="test")
controller = plug_in(PlugInKind.CONTROLLER, "lines").open(config)
controller.play(LoopProgram(frequency_hz=100, reference_v=((0.5, 0.0),)))
print("playing", flush=True)
while True:
    controller.report()
"""


@pytest.mark.thorough
def test_a_controller_goes_silent_when_its_host_is_killed():
    rig = load_rig("virtual_rig")
    config = ControllerConfig(rate_hz=10_240, latency_s=3e-4, limit_v=2, source="test")
    virtual = VirtualRig(rig.model_copy(update={"controller": config}))
    drive = Input("cDAQ1Mod1/ai0", 5.0, Coupling.DC)
    with (
        virtual,
        subprocess.Popen(
            [sys.executable, "-c", HOST, virtual.controller_resource], stdout=subprocess.PIPE, text=True
        ) as host,
    ):
        assert host.stdout.readline() == "playing\n"
        sampler = virtual.world.sample((drive,), 10_240.0)
        alive = sampler.read(5_120)[0]
        host.kill()
        host.wait()
        # This request restarts the watchdog, so that its whole time is still to pass.
        virtual.controller.execute(b'{"ask": "report"}')
        until = sampler.read(9_000)[0]
        after = sampler.read(5_120)[0]
    assert np.abs(alive[-500:]).max() > 0.2
    assert np.abs(until[-1000:]).max() > 0.2
    assert np.abs(after[-2_000:]).max() < 2e-3
