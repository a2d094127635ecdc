"""Calibrated sound card as converter and analogue output, over PortAudio.

A sound card does not report volts and passes no DC. Its full scale is therefore measured once and entered in
``daq.options`` (docs/instruments.md, decision 0054); without this value, no card is opened. Inputs and output
form one stream, so apart from the card's delay they start together.
"""

from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from threading import Condition
from typing import Any, Self

import numpy as np

from vibench.acquisition.drivers import overload_ranges, require_playable
from vibench.acquisition.errors import (
    ConfigurationError,
    DataLost,
    InstrumentError,
    InstrumentLost,
    MissingLibrary,
)
from vibench.acquisition.instruments import Block, Identity, IdleOutput, Samples
from vibench.acquisition.rig import Channel, OutputConfig, Rig, channels_of

_LATEST_S = 10.0
"""Time without samples after which the card counts as lost [s]."""
_SAME_RATE = 1e-6

_NEEDED = "calibrated", "input_full_scale_v", "low_cut_hz"


def _sounddevice() -> Any:
    """Load the library; raises MissingLibrary if the system's PortAudio is not installed."""
    try:
        return import_module("sounddevice")
    except OSError as error:
        raise MissingLibrary(
            f"{error}; nothing was opened: install PortAudio on this system (Debian: libportaudio2)"
        ) from error


class _Card:
    """One stream of a card; its callback runs in a thread of PortAudio."""

    def __init__(self, rig: Rig, inputs: tuple[int, ...], output: int | None) -> None:
        daq, library, self.rate_hz = rig.daq, _sounddevice(), rig.daq.sample_rate_hz
        self.inputs = inputs
        self.changed = Condition()
        self.blocks: deque[Samples] = deque()
        self.waiting = 0
        self.most_waiting = round(daq.buffer_s * self.rate_hz)
        self.queued: deque[Samples] = deque()
        self.unplayed = 0
        self.is_armed = False
        self.failure = ""
        self.ran_dry = False
        self._output = output
        highest = 1 + max(inputs)
        common = {"samplerate": self.rate_hz, "dtype": "float32", "device": daq.device}
        self.stream: Any = (
            library.InputStream(channels=highest, callback=self._take_block, **common)
            if self._output is None
            else library.Stream(channels=(highest, 1 + self._output), callback=self._hear_and_play, **common)
        )

    def begin(self) -> None:
        with self.changed:
            self.blocks.clear()
            self.waiting, self.failure = 0, ""
        self.stream.start()

    def drop(self) -> None:
        with self.changed:
            self.queued.clear()
            self.unplayed, self.is_armed, self.ran_dry = 0, False, False
            self.changed.notify_all()

    def _take_block(self, heard: Samples, frames: int, time: object, status: Any) -> None:
        del frames, time
        with self.changed:
            if status.input_overflow or self.waiting > self.most_waiting:
                self.failure = "samples were overwritten before they were read"
            if not self.failure:  # discard the card's samples after a failure
                self.blocks.append(heard.T[list(self.inputs)].astype(np.float64))
                self.waiting += heard.shape[0]
            self.changed.notify_all()

    def _hear_and_play(self, heard: Samples, played: Samples, frames: int, time: object, status: Any) -> None:
        played.fill(0.0)
        with self.changed:
            if self.is_armed and self._output is not None:
                samples = self._next_samples(frames)
                played[: samples.size, self._output] = samples
                self.ran_dry = self.ran_dry or samples.size < frames or bool(status.output_underflow)
        self._take_block(heard, frames, time, status)

    def _next_samples(self, frames: int) -> Samples:
        parts, left = [np.zeros(0)], frames
        while left and self.queued:
            part = self.queued.popleft()
            if part.size > left:
                self.queued.appendleft(part[left:])
                part = part[:left]
            parts.append(part)
            left -= part.size
        self.unplayed -= frames - left
        return np.concatenate(parts)


class SoundCardDigitizer:
    """A `Digitizer` on the inputs of a sound card; ``physical`` is ``"in0"``, ``"in1"``, ..."""

    def __init__(self, card: _Card, rig: Rig, channels: tuple[Channel, ...]) -> None:
        self.card = card
        self.options = rig.daq.options
        self._device = rig.daq.device
        self._channels = channels
        self.sample_rate_hz = float(card.stream.samplerate)
        """Sample rate that PortAudio reports [1/s]."""
        self.roles = tuple(channel.role.value for channel in channels)
        """Roles of the channels, in the row order of a block."""
        self.volts_per_count = (None,) * len(channels)
        """None for each channel, because PortAudio returns fractions of full scale, not converter counts."""
        self._full_scale_v = float(rig.daq.options["input_full_scale_v"])
        self._next_sample = 0
        self._is_running = False
        self._is_open = True

    @classmethod
    def open(cls, rig: Rig) -> Self:
        """Open the card named in ``daq.device`` with its calibration, and return the digitizer.

        Raises
        ------
        ConfigurationError
            When a calibration value is missing, or an input needs DC coupling or a sensor current.
        InstrumentLost, InstrumentError
            When there is no such card, or the card does not support the sample rate.
        """
        _require_calibration(rig)
        channels = channels_of(rig)
        inputs = tuple(_input(channel, rig) for channel in channels)
        output = None if rig.daq.output is None else _number(rig.daq.output.physical, "ao")
        try:
            card = _Card(rig, inputs, output)
        except ValueError as error:
            raise InstrumentLost(
                f"there is no sound card {rig.daq.device!r} ({error}); set daq.device to an existing card"
            ) from error
        except _sounddevice().PortAudioError as error:
            raise InstrumentError(
                f"the sound card {rig.daq.device!r} cannot be opened at {rig.daq.sample_rate_hz:g} samples "
                f"a second ({error}); give a supported rate and channels, and close programs that use it"
            ) from error
        if not abs(card.stream.samplerate - card.rate_hz) <= _SAME_RATE * card.rate_hz:
            card.stream.close()
            raise InstrumentError(
                f"the sound card {rig.daq.device!r} runs at {card.stream.samplerate:g} samples a second, but "
                f"{card.rate_hz:g} were requested; set daq.sample_rate_hz to a rate that the card supports"
            )
        return cls(card, rig, channels)

    @property
    def identity(self) -> Identity:
        """Name of the card, version of PortAudio, and calibration."""
        version = _sounddevice().get_portaudio_version()[1]
        reply = f"{self._device}, {version}, {', '.join(f'{key} {self.options[key]}' for key in _NEEDED)}"
        return Identity("", self._device, "", version, reply)

    def start(self) -> None:
        """Start sampling, and start playing if the output is armed."""
        if not self._is_open or self._is_running:
            raise InstrumentError(f"{self._device} is closed, or already sampling; open it, or stop it first")
        self._next_sample = 0
        with _portaudio(f"starting {self._device}"):
            self.card.begin()
        self._is_running = True

    def read(self, samples: int) -> Block:
        """Return the next samples; raises DataLost if some were overwritten, InstrumentLost if none came."""
        if not self._is_running or samples < 1:
            raise InstrumentError(
                f"{samples} samples were requested from {self._device}, which is not sampling; start the card"
            )
        card = self.card
        with card.changed:
            wait_s = samples / card.rate_hz + _LATEST_S
            came = card.changed.wait_for(lambda: card.failure or card.waiting >= samples, wait_s)
            if card.failure:
                raise DataLost(
                    f"{self._device}: {card.failure}. Stop, then read more often, or raise daq.buffer_s"
                )
            if not came:
                raise InstrumentLost(f"{self._device} delivers no more samples; check that it is plugged in")
            joined = np.concatenate(list(card.blocks), axis=1)
            card.blocks.clear()
            card.blocks.append(joined[:, samples:])
            card.waiting -= samples
        first, self._next_sample = self._next_sample, self._next_sample + samples
        volts = joined[:, :samples] * self._full_scale_v
        scales_v = tuple(channel.full_scale_v for channel in self._channels)
        return Block(first, volts, overload_ranges(volts, self.roles, scales_v, first))

    @property
    def waiting_samples(self) -> int:
        """Number of samples per channel that have not been read yet."""
        return self.card.waiting

    def stop(self) -> None:
        """End sampling. May be called at any time."""
        if self._is_running:
            self._is_running = False
            with _portaudio(f"stopping {self._device}"):
                self.card.stream.abort()

    def close(self) -> None:
        """Release the card. May be called at any time."""
        self.stop()
        if self._is_open:
            self._is_open = False
            with _portaudio(f"closing {self._device}"):
                self.card.stream.close()


class SoundCardOutput:
    """An `AnalogOutput` on the card of a `SoundCardDigitizer`, in the same stream."""

    idle = IdleOutput.ZERO

    def __init__(self, physical: str, config: OutputConfig, digitizer: SoundCardDigitizer) -> None:
        self._physical = physical
        self._config = config
        self._digitizer = digitizer
        self.sample_rate_hz = digitizer.sample_rate_hz
        """Sample rate of the stream [1/s]."""
        self.ahead_samples = int(config.ahead_s * digitizer.sample_rate_hz)
        """Largest number of samples that can be written ahead of the sample being played."""
        self._card = digitizer.card
        self._full_scale_v = float(digitizer.options["output_full_scale_v"])
        self._is_open = True

    @classmethod
    def open(cls, physical: str, config: OutputConfig, digitizer: SoundCardDigitizer) -> Self:
        """Open the output of the stream; raises ConfigurationError for a wrong rate or an excessive limit."""
        output = cls(physical, config, digitizer)
        if config.sample_rate_hz != digitizer.sample_rate_hz or config.limit_v > output._full_scale_v:
            raise ConfigurationError(
                f"daq.output is set to {config.limit_v:g} V at {config.sample_rate_hz:g} samples a second; "
                f"the card gives {output._full_scale_v:g} V at {digitizer.sample_rate_hz:g}, the rate of its "
                "inputs. Lower limit_v, or use this rate"
            )
        return output

    @property
    def identity(self) -> Identity:
        """Identity of the card, with the name of its output."""
        card = self._digitizer.identity
        return Identity(card.maker, card.model, "", card.firmware, f"{self._physical} of {card.reply}")

    def write(self, volts: Samples) -> None:
        """Add samples after those still to be played; wait for room. Errors: see `AnalogOutput.write`."""
        require_playable(volts, self._physical, self._config.limit_v, is_open=self._is_open)
        card, needed = self._card, np.asarray(volts, dtype=np.float64).size
        with card.changed:
            there_is_room = card.changed.wait_for(
                lambda: card.ran_dry or card.unplayed + needed <= self.ahead_samples, _LATEST_S
            )
            if card.ran_dry or not there_is_room:
                raise DataLost(
                    f"{self._physical} ran out of samples or stopped, so its signal ended; start again"
                )
            card.queued.append(np.asarray(volts, dtype=np.float64) / self._full_scale_v)
            card.unplayed += needed

    def arm(self) -> None:
        """Let the output start playing at the digitizer's start."""
        with self._card.changed:
            if not self._card.unplayed:
                raise InstrumentError(
                    f"{self._physical} has nothing to play; write the first samples, then arm"
                )
            self._card.is_armed = True

    def stop(self) -> None:
        """Play zero volts, starting with the next block. May be called at any time."""
        self._card.drop()

    def close(self) -> None:
        """Play zero volts and accept no more samples. May be called at any time."""
        self._is_open = False
        self.stop()


@contextmanager
def _portaudio(doing: str) -> Iterator[None]:
    try:
        yield
    except _sounddevice().PortAudioError as error:
        raise InstrumentLost(f"{doing} failed ({error}); check that the card is plugged in") from error


def _require_calibration(rig: Rig) -> None:
    needed = (*_NEEDED, "output_full_scale_v") if rig.daq.output is not None else _NEEDED
    if missing := [key for key in needed if key not in rig.daq.options]:
        raise ConfigurationError(
            f"a sound card must be calibrated, but daq.options has no {', '.join(missing)}. Nothing was "
            "opened; record a known sine with the card, measure the card's output voltage at full scale, "
            "and enter these values (docs/instruments.md)"
        )
    for key in needed[1:]:
        value = rig.daq.options[key]
        if isinstance(value, (str, bool)) or not value > 0:
            raise ConfigurationError(
                f"daq.options.{key} = {value!r}; give a number above 0. Nothing was opened"
            )


def _input(channel: Channel, rig: Rig) -> int:
    """Return the index of a card's input; raises ConfigurationError for settings that no card supports."""
    name = channel.physical.rpartition("/")[2]
    full_scale_v = float(rig.daq.options["input_full_scale_v"])
    if (
        channel.coupling != "AC"
        or channel.iepe_current_a
        or channel.range_v > full_scale_v * (1 + _SAME_RATE)
    ):
        raise ConfigurationError(
            f"{channel.role.value}: a sound card's input is AC-coupled, gives no sensor current, and reaches "
            f"{full_scale_v:g} V here; {channel.coupling}, {1e3 * channel.iepe_current_a:g} mA and "
            f'{channel.range_v:g} V were requested. Set coupling = "AC", lower range_v, and use a '
            "separate IEPE supply"
        )
    return _number(name, "in")


def _number(name: str, side: str) -> int:
    number = name.removeprefix(side)
    if number == name or not number.isdecimal():
        raise ConfigurationError(
            f"physical = {name!r} is not on a sound card; inputs are in0, in1, ...; outputs are ao0, ao1, ..."
        )
    return int(number)
