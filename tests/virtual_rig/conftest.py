"""A small analogue world in a loop, and programs connected to a simulated DAQ that samples it."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field

import grpc
import numpy as np
import pytest
from nidaqmx import DaqError, GrpcSessionOptions, Task
from nidaqmx.constants import AcquisitionType

from vibench.acquisition import ConfigurationError
from vibench.virtual_rig.daqmx.rig import Pace
from vibench.virtual_rig.daqmx.server import DaqServer
from vibench.virtual_rig.world.conversion import Coupling, Input

OFFSET_V = 0.5
LOOPED_BACK = {"Dev1/ai0": "Dev1/ao0", "Dev2/ai0": "Dev2/ao0"}


def signal(physical_channel: str, time_s):
    """Return the voltage of a channel without a cable to an output: a sine on an offset of 0.5 V."""
    number = int(physical_channel.rpartition("ai")[2])
    return OFFSET_V + (number + 1) * np.sin(2 * np.pi * 40 * (number + 1) * time_s)


@dataclass
class Played:
    """Samples that an output plays from a given time on."""

    start_s: float
    rate_hz: float
    volts: np.ndarray

    @property
    def end_s(self) -> float:
        return self.start_s + self.volts.size / self.rate_hz


@dataclass
class Sampling:
    """Ideal conversion without noise and delay; clips at the range, and AC coupling removes the offset."""

    world: "LoopbackWorld"
    inputs: tuple[Input, ...]
    rate_hz: float
    start_s: float
    count: int = 0
    clipped: np.ndarray | None = None

    def read(self, count: int) -> np.ndarray:
        time_s = self.start_s + (self.count + np.arange(count)) / self.rate_hz
        self.count += count
        self.world.time_s = max(self.world.time_s, self.start_s + self.count / self.rate_hz)
        volts = np.stack([self.world.voltage(each, time_s) for each in self.inputs])
        limits = np.array([[each.range_v] for each in self.inputs])
        clipped = np.any(np.abs(volts) > limits, axis=1)
        self.clipped = clipped if self.clipped is None else self.clipped | clipped
        return np.clip(volts, -limits, limits)

    def overload_flags(self) -> np.ndarray:
        clipped, self.clipped = self.clipped, None
        return np.zeros(len(self.inputs), bool) if clipped is None else clipped

    def close(self) -> None:
        self.world.conversions.remove(self)


@dataclass
class LoopbackWorld:
    """A world in which every input shows a different sine, except inputs wired to an output."""

    time_s: float = 0.0
    gain: float = 1.0
    slowest_hz: float = 0.0
    played: dict[str, list[Played]] = field(default_factory=dict)
    conversions: list[Sampling] = field(default_factory=list)
    wirings: list[tuple[Input, ...]] = field(default_factory=list)

    def advance(self, duration_s: float) -> None:
        self.time_s += duration_s

    def sample(self, inputs: tuple[Input, ...], sample_rate_hz: float) -> Sampling:
        if sample_rate_hz < self.slowest_hz:
            raise ConfigurationError(f"{sample_rate_hz:g} Hz; {self.slowest_hz:g} Hz is possible")
        conversion = Sampling(self, inputs, sample_rate_hz, self.time_s)
        self.conversions.append(conversion)
        self.wirings.append(inputs)
        return conversion

    def voltage(self, wired: Input, time_s: np.ndarray) -> np.ndarray:
        if wired.physical_channel in LOOPED_BACK:
            return self.output(LOOPED_BACK[wired.physical_channel], time_s)
        offset = OFFSET_V if wired.coupling is Coupling.AC else 0.0
        return self.gain * signal(wired.physical_channel, time_s) - offset

    def output(self, channel: str, time_s: np.ndarray) -> np.ndarray:
        volts = np.zeros_like(time_s)
        for stretch in self.played.get(channel, []):
            index = np.floor((time_s - stretch.start_s) * stretch.rate_hz + 1e-6).astype(int)
            inside = (index >= 0) & (index < stretch.volts.size)
            volts[inside] = stretch.volts[index[inside]]
        return volts

    def play(self, channel: str, volts: np.ndarray, sample_rate_hz: float) -> None:
        stretches = self.played.setdefault(channel, [])
        end_s = stretches[-1].end_s if stretches else 0.0
        start_s = end_s if end_s > self.time_s - 1e-9 else self.time_s
        stretches.append(Played(start_s, sample_rate_hz, np.array(volts)))

    def silence(self, channel: str) -> None:
        kept = []
        for stretch in self.played.get(channel, []):
            count = int(np.ceil((self.time_s - stretch.start_s) * stretch.rate_hz - 1e-6))
            if count > 0:
                kept.append(Played(stretch.start_s, stretch.rate_hz, stretch.volts[:count]))
        self.played[channel] = kept


@dataclass
class Daq:
    """A running server, the world behind it, and the options with which a client connects."""

    server: DaqServer
    world: LoopbackWorld
    options: GrpcSessionOptions
    resources: ExitStack

    def task(self, name: str = "") -> Task:
        """Create a task that is closed with the test."""
        return self.resources.enter_context(Task(name, grpc_options=self.options))

    def inputs(
        self, channels: str, rate_hz: float | None = None, samples: int | None = None, **limits
    ) -> Task:
        """Create a task of inputs: on demand without a rate, continuous unless ``samples`` are given."""
        task = self.task()
        task.ai_channels.add_ai_voltage_chan(channels, **limits)
        if samples is not None:
            task.timing.cfg_samp_clk_timing(rate_hz, samps_per_chan=samples)
        elif rate_hz is not None:
            task.timing.cfg_samp_clk_timing(rate_hz, sample_mode=AcquisitionType.CONTINUOUS)
        return task

    def outputs(self, channels: str = "Dev1/ao0", limit_v: float = 1.0) -> Task:
        task = self.task()
        task.ao_channels.add_ao_voltage_chan(channels, min_val=-limit_v, max_val=limit_v)
        return task


@contextmanager
def daq_error(code, match: str | None = None, kind: type[DaqError] = DaqError) -> Iterator:
    """Require a driver error with this code; yields the exception info."""
    with pytest.raises(kind, match=match) as caught:
        yield caught
    assert caught.value.error_code == code


@pytest.fixture
def connect() -> Iterator:
    """Return a function that serves a new world at a pace and connects to it."""
    with ExitStack() as resources:

        def open_daq(pace: Pace | None = None, **options) -> Daq:
            world = LoopbackWorld()
            server = resources.enter_context(DaqServer(world, pace, **options))
            unlimited = [("grpc.max_receive_message_length", -1), ("grpc.max_send_message_length", -1)]
            channel = resources.enter_context(grpc.insecure_channel(server.address, options=unlimited))
            tasks = resources.enter_context(ExitStack())
            return Daq(server, world, GrpcSessionOptions(channel, ""), tasks)

        yield open_daq


@pytest.fixture
def daq(connect) -> Daq:
    """A simulated DAQ that delivers samples immediately."""
    return connect()
