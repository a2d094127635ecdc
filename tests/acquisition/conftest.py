"""A simulated bench in a loop: the converter measures the generator's output; both can be made to fail."""

from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from tests.changed import changed
from vibench.acquisition import Block, Identity
from vibench.acquisition.errors import DataLost
from vibench.acquisition.instruments import IdleOutput, Samples, Sweep
from vibench.acquisition.recording import RecordingState
from vibench.acquisition.rig import (
    BaseQuantity,
    Channel,
    KnobSheet,
    OutputConfig,
    Rig,
    RigModel,
    Role,
    channels_of,
    load_rig,
)
from vibench.acquisition.stopping.stop import DRIVES_ON

SAMPLE_RATE_HZ = 5120.0
Fault = Callable[[], BaseException]


@dataclass
class LoopbackWorld:
    """State shared by the simulated instruments: output, converted samples, and all calls."""

    rig: Rig
    samples: int = 0
    is_on: bool = False
    is_sampling: bool = False
    amplitude_vpp: float = 0.0
    cycles: float = 0.0
    frequency_hz: float = 1.0
    period: Samples | None = None
    calls: list[tuple[str, object, int]] = field(default_factory=list)
    faults: dict[str, list[Fault]] = field(default_factory=dict)
    permanent: dict[str, Fault] = field(default_factory=dict)
    streamed: list[float] = field(default_factory=list)
    streams: bool = False
    played: int = 0
    drive_factor: float = 1.0
    stays_on: bool = False
    """Whether the output stays on after a stop command."""
    hum_v: float = 0.0
    base_factor: float = 1.0
    background_m_per_s2: float = 0.0
    overloads: tuple = ()
    latency_s: float = 0.0
    """Duration of each generator command [s], during which samples are converted."""
    convert: Callable[[int], None] | None = None
    """Converts a number of samples, which then wait to be read."""

    def command(self, name: str, argument: object = None) -> None:
        """Record a generator command, which takes `latency_s` before it is in force."""
        self.call(name, argument)
        if self.is_sampling and self.latency_s > 0:
            self.convert(round(self.latency_s * SAMPLE_RATE_HZ))

    def call(self, name: str, argument: object = None) -> None:
        self.calls.append((name, argument, self.samples))
        failure = None
        if self.faults.get(name):
            failure = self.faults[name].pop(0)()
        elif name in self.permanent:
            failure = self.permanent[name]()
        if failure is not None:
            raise failure

    def amplitudes(self) -> list[tuple[int, float]]:
        """Return every amplitude setting, with the sample at which it was made."""
        return [(at, value) for name, value, at in self.calls if name == "amplitude"]

    def terminal(self, count: int) -> Samples:
        """Return the next samples at the generator's terminal [V]; the phase continues."""
        cycles = self.cycles + self.frequency_hz * np.arange(count) / SAMPLE_RATE_HZ
        self.cycles = (self.cycles + self.frequency_hz * count / SAMPLE_RATE_HZ) % 1.0
        if self.streams:
            return self.stream(count)
        if not self.is_on:
            return np.zeros(count)
        if self.period is None:
            shape = np.sin(2 * np.pi * cycles)
        else:
            place = np.floor(cycles * len(self.period) + 1e-9).astype(int) % len(self.period)
            shape = self.period[place]
        return 0.5 * self.amplitude_vpp * self.rig.generator.terminal_factor() * shape

    def stream(self, count: int) -> Samples:
        """Return the next samples of the analogue output [V]; zero after the last written sample."""
        heard = np.zeros(count)
        written = np.array(self.streamed[self.samples : self.samples + count])
        heard[: written.size] = written
        self.played = max(self.played, self.samples + count)
        return heard


class LoopbackGenerator:
    """A FunctionGenerator that records its calls and can be made to fail."""

    identity = Identity("MAKER", "GENERATOR", "1", "1.0", "MAKER,GENERATOR,1,1.0")

    unconfirmed = ()
    amplitude_range_vpp = (2e-3, 20.0)

    def __init__(self, world: LoopbackWorld) -> None:
        self._world = world

    def load_sine(self, frequency_hz: float, amplitude_vpp: float) -> None:
        self._world.command("load_sine", frequency_hz)
        self._world.period = None
        self._world.frequency_hz = frequency_hz
        self._set(amplitude_vpp)

    def load_waveform(self, waveform: Samples, repetition_hz: float, amplitude_vpp: float) -> None:
        self._world.command("load_waveform", waveform)
        assert np.max(np.abs(waveform)) <= 1.0
        self._world.period = waveform
        self._world.frequency_hz = repetition_hz
        self._set(amplitude_vpp)

    def load_sweep(self, sweep: Sweep, amplitude_vpp: float) -> None:
        self._world.command("load_sweep", sweep)
        self.load_sine(sweep.start_hz, amplitude_vpp)

    def set_frequency(self, frequency_hz: float) -> None:
        self._world.command("set_frequency", frequency_hz)
        assert self._world.period is None
        self._world.frequency_hz = frequency_hz

    def set_amplitude(self, amplitude_vpp: float) -> None:
        self._world.command("set_amplitude", amplitude_vpp)
        self._set(amplitude_vpp)

    def arm_burst(self, cycles: int) -> None:
        self._world.call("arm_burst", cycles)

    def trigger(self) -> None:
        self._world.call("trigger")

    def end_burst(self) -> None:
        self._world.call("end_burst")

    def measured_latency_s(self) -> float:
        return self._world.latency_s

    def start(self) -> None:
        self._world.command("start")
        self._world.is_on = True

    def stop(self) -> None:
        self._world.command("stop")
        self._world.is_on = self._world.stays_on

    def close(self) -> None:
        self.stop()

    def _set(self, amplitude_vpp: float) -> None:
        assert 2e-3 <= amplitude_vpp <= self._world.rig.generator.amplitude_limit_vpp
        self._world.amplitude_vpp = amplitude_vpp
        self._world.calls.append(("amplitude", amplitude_vpp, self._world.samples))


class LoopbackOutput:
    """An AnalogOutput with a buffer of half a second that keeps its samples and can be made to fail."""

    identity = Identity("MAKER", "OUTPUT", "3", "1.0", "OUTPUT")
    sample_rate_hz = SAMPLE_RATE_HZ
    ahead_samples = 2560
    idle = IdleOutput.ZERO

    def __init__(self, world: LoopbackWorld) -> None:
        self._world = world

    def write(self, volts: Samples) -> None:
        world = self._world
        world.call("write", volts.size)
        if world.streams and world.played > len(world.streamed):
            raise DataLost("the output ran out of samples")
        world.streamed.extend(volts)
        # The buffer is full: the output plays until there is room.
        world.played = max(world.played, len(world.streamed) - self.ahead_samples)

    def arm(self) -> None:
        self._world.call("arm")
        assert self._world.streamed
        assert not self._world.is_sampling
        self._world.streams = True

    def stop(self) -> None:
        self._world.call("output.stop")
        self._world.streams = False

    def close(self) -> None:
        self.stop()


class LoopbackDigitizer:
    """A Digitizer in the loop: all channels follow the generator, and m0 moves with the base."""

    identity = Identity("MAKER", "DIGITIZER", "2", "1.0", "DIGITIZER")
    sample_rate_hz = SAMPLE_RATE_HZ

    def __init__(self, world: LoopbackWorld, channels: tuple[Channel, ...]) -> None:
        self._world = world
        self._channels = channels
        self._first = 0
        self._velocity = np.zeros(1)
        self._accelerance = abs(complex(RigModel(world.rig).transfer(BaseQuantity.ACCELERATION, 160.0)))
        self._waiting = np.zeros((len(channels), 0))
        world.convert = self._convert

    @property
    def roles(self) -> tuple[str, ...]:
        return tuple(channel.role.value for channel in self._channels)

    @property
    def volts_per_count(self) -> tuple[float | None, ...]:
        return (None,) * len(self._channels)

    @property
    def waiting_samples(self) -> int:
        return self._waiting.shape[1]

    def start(self) -> None:
        self._world.call("digitizer.start")
        self._world.samples = 0
        self._waiting = self._waiting[:, :0]
        self._world.is_sampling = True

    def read(self, samples: int) -> Block:
        world = self._world
        world.call("digitizer.read", samples)
        assert world.is_sampling
        assert samples > 0
        self._convert(max(0, samples - self.waiting_samples))
        volts, self._waiting = np.split(self._waiting, [samples], axis=1)
        block = Block(world.samples, volts, world.overloads)
        world.samples += samples
        return block

    def _convert(self, samples: int) -> None:
        world = self._world
        if not samples:
            return
        drive = world.terminal(samples)
        first = world.samples + self.waiting_samples
        angle = 2 * np.pi * 160.0 * (first + np.arange(samples)) / SAMPLE_RATE_HZ
        base = drive * self._accelerance * world.base_factor + world.background_m_per_s2 * np.sin(angle)
        physical = {
            Role.DRIVE_VOLTAGE: drive * world.drive_factor + world.hum_v * np.sin(angle * 50 / 160),
            Role.AMPLIFIER_VOLTAGE: drive * world.rig.amplifier.gain,
            Role.BASE_ACCELERATION: base,
            Role.M0_VELOCITY: self._integrate(base),
        }
        volts = np.stack([physical[channel.role] / channel.units_per_volt for channel in self._channels])
        self._waiting = np.concatenate((self._waiting, volts), axis=1)

    def _integrate(self, acceleration: Samples) -> Samples:
        """Return the velocity of this acceleration; contributions older than some seconds decay."""
        leak = 1 - 2 * np.pi * 0.1 / SAMPLE_RATE_HZ
        velocity, self._velocity = lfilter([1 / SAMPLE_RATE_HZ], [1, -leak], acceleration, zi=self._velocity)
        return velocity

    def stop(self) -> None:
        self._world.call("digitizer.stop")
        self._world.is_sampling = False

    def close(self) -> None:
        self.stop()


class MemoryRecorder:
    """A recorder that keeps everything in memory."""

    def __init__(self, world: LoopbackWorld) -> None:
        self._world = world
        self.header = None
        self.path = None
        self.blocks: list[Block] = []
        self.events: list[tuple[int, str, str]] = []
        self.segments: list[dict] = []
        self.ending: tuple[RecordingState, str] | None = None

    def create(self, path, header):
        self._world.call("recorder.create")
        self.path, self.header = path, header
        return self

    @property
    def samples(self) -> int:
        return sum(block.volts.shape[1] for block in self.blocks)

    def append(self, block: Block) -> None:
        self._world.call("recorder.append")
        assert block.first_sample == self.samples
        self.blocks.append(block)

    def log(self, kind: str, text: str, sample: int | None = None) -> None:
        self.events.append((self.samples if sample is None else sample, kind, text))

    def begin_segment(self, label: str, **numbers) -> None:
        assert not self.segments or self.segments[-1]["last"] is not None
        self.segments.append({"label": label, "numbers": numbers, "first": self.samples, "last": None})

    def end_segment(self) -> None:
        assert self.segments[-1]["last"] is None
        self.segments[-1]["last"] = self.samples - 1

    def finish(self, state: RecordingState, reason: str = "") -> Path:
        self._world.call("recorder.finish")
        self.ending = (state, reason)
        return self.path

    def states(self) -> list[str]:
        return [text for _, kind, text in self.events if kind == "state"]

    def channel(self, row: int) -> Samples:
        """Return all volts of one channel."""
        return np.concatenate([block.volts[row] for block in self.blocks])


class LoopbackBench:
    """The simulated instruments as a bench."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.world = LoopbackWorld(rig)
        self.channels = channels_of(rig)
        self.generator = LoopbackGenerator(self.world)
        self.digitizer = LoopbackDigitizer(self.world, self.channels)
        self.output = None
        self.controller = None
        self.identities = {"generator": self.generator.identity, "digitizer": self.digitizer.identity}
        self.confirmations = KnobSheet(operator="test", confirmed=datetime.now(UTC), knobs=rig.knobs)
        self.last_check = None
        self.recorder = MemoryRecorder(self.world)
        self.idled_s = 0.0

    def idle(self, duration_s: float) -> None:
        """Let time pass without waiting."""
        self.idled_s += duration_s


@pytest.fixture(autouse=True)
def no_drive_left_on() -> None:
    """Forget drives of earlier tests whose silence could not be confirmed, as a new process would."""
    DRIVES_ON._drives.clear()


@pytest.fixture(scope="session")
def rig() -> Rig:
    """The default rig at a low sample rate; it cannot be changed."""
    shipped = load_rig("virtual_rig")
    return changed(shipped, daq={"sample_rate_hz": SAMPLE_RATE_HZ})


@pytest.fixture
def bench(rig: Rig) -> LoopbackBench:
    """A bench of simulated instruments in a loop."""
    return LoopbackBench(rig)


@pytest.fixture
def streaming_bench(rig: Rig) -> LoopbackBench:
    """The same bench with an analogue output."""
    output = OutputConfig(physical="ao0", limit_v=5.0, sample_rate_hz=SAMPLE_RATE_HZ, source="test")
    with_output = changed(rig, daq={"output": output})
    bench = LoopbackBench(with_output)
    bench.output = LoopbackOutput(bench.world)
    return bench


@pytest.fixture(scope="session")
def new_bench() -> Callable[[Rig], LoopbackBench]:
    """Return the class that makes benches, for tests that need several."""
    return LoopbackBench
