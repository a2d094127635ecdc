"""Measure the speed of the virtual rig in rig seconds per second, with four channels at 51.2 kS/s.

Run ``python benchmarks/virtual_rig.py``. Each line is the best of three runs of the simulated world alone
(generator, amplifier, shaker, specimen, sensors, converter). The last line is with real pyvisa and nidaqmx.
"""

import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import grpc
import nidaqmx
import numpy as np
import pyvisa
from nidaqmx.constants import AcquisitionType
from nidaqmx.stream_readers import AnalogMultiChannelReader

from vibench.acquisition.rig import Rig, load_rig
from vibench.virtual_rig import VirtualRig
from vibench.virtual_rig.generator.afg1022 import AFG1022
from vibench.virtual_rig.generator.terminal_voltage import Terminal
from vibench.virtual_rig.world.conversion import Coupling, Input
from vibench.virtual_rig.world.time_grid import USUAL_GRID
from vibench.virtual_rig.world.world import World

RATE_HZ = 51_200
BLOCK = 5120
SECONDS = 4
REPEATS = 3
LEVELS_VPP = {"linear": 0.05, "colliding": 1.5, "strongly colliding": 10.0}


def main() -> None:
    """Measure the speed at every level and print it."""
    rig = load_rig(Path(__file__).parent.parent / "hardware_configs" / "virtual_rig.toml")
    print(f"{'motion at 260 Hz':22}{'level':>10}{'impacts/s':>11}{'steps/s':>12}{'x real time':>13}")
    for motion, amplitude_vpp in LEVELS_VPP.items():
        factor, impacts_per_s = world_speed(rig, amplitude_vpp)
        steps = factor * USUAL_GRID.rate_hz
        print(f"{motion:22}{amplitude_vpp:>6} Vpp{impacts_per_s:>11.0f}{steps:>12.3g}{factor:>13.1f}")
    print(f"through pyvisa and nidaqmx, 1.5 Vpp: {whole_chain_speed(rig, 1.5):.1f} x real time")


def world_speed(rig: Rig, amplitude_vpp: float) -> tuple[float, float]:
    """Return rig seconds per second of the simulated world alone, and impacts per rig second."""
    inputs = tuple(
        Input(f"{rig.daq.device}/{one.physical}", one.range_v, Coupling(one.coupling), one.iepe_current_a)
        for one in rig.daq.channels
    )
    generator = AFG1022(lambda: world.time_s, terminal=Terminal(noise_v_per_rt_hz=1e-6))
    world = World(rig, generator)
    for command in sine(amplitude_vpp):
        generator.execute(command.encode())
    sampler = world.sample(inputs, RATE_HZ)
    sampler.read(RATE_HZ)  # loads all code, and lets the motion settle
    before = world.plant.impacts
    best = min(clock(lambda: sampler.read(BLOCK)) for _ in range(REPEATS))
    return SECONDS / best, (world.plant.impacts - before) / (REPEATS * SECONDS)


def whole_chain_speed(rig: Rig, amplitude_vpp: float) -> float:
    """Return rig seconds per second for a program that reads with nidaqmx."""
    with ExitStack() as resources:
        virtual = resources.enter_context(VirtualRig(rig))
        manager = pyvisa.ResourceManager("@py")
        resources.callback(manager.close)
        generator = manager.open_resource(virtual.visa_resource)
        for command in sine(amplitude_vpp):
            generator.write(command)
        channel = resources.enter_context(grpc.insecure_channel(virtual.daq_address))
        task = resources.enter_context(nidaqmx.Task(grpc_options=nidaqmx.GrpcSessionOptions(channel, "")))
        task.ai_channels.add_ai_voltage_chan(f"{rig.daq.device}/ai0:3", min_val=-5, max_val=5)
        task.timing.cfg_samp_clk_timing(
            RATE_HZ, sample_mode=AcquisitionType.CONTINUOUS, samps_per_chan=10 * RATE_HZ
        )
        reader = AnalogMultiChannelReader(task.in_stream)
        reader.verify_array_shape = False
        block = np.empty((4, BLOCK))
        reader.read_many_sample(block, BLOCK)
        return SECONDS / min(clock(lambda: reader.read_many_sample(block, BLOCK)) for _ in range(REPEATS))


def sine(amplitude_vpp: float) -> tuple[str, ...]:
    """Return the commands for a sine at the paper's 260 Hz."""
    return ("OUTP1:IMP INF", "FUNC SIN", "FREQ 260", f"VOLT {amplitude_vpp}VPP", "OUTP1:STAT ON")


def clock(read: Callable[[], object]) -> float:
    """Return the time to read ``SECONDS`` of rig time, block by block [s]."""
    begun = time.perf_counter()
    for _ in range(SECONDS * RATE_HZ // BLOCK):
        read()
    return time.perf_counter() - begun


if __name__ == "__main__":
    main()
