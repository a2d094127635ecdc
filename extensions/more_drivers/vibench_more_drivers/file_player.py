"""Digitizer that replays a recording as if it were measured."""

from contextlib import ExitStack
from pathlib import Path
from typing import Self

import numpy as np

from vibench.acquisition.drivers import NoGenerator
from vibench.acquisition.errors import ConfigurationError, DataLost, InstrumentError, InstrumentLost
from vibench.acquisition.instruments import Block, Identity, Overload
from vibench.acquisition.recording import Recording, SealDepth, SealState, open_recording
from vibench.acquisition.rig import Channel, Rig, channels_of

FILE_GENERATOR = NoGenerator("a recording", "the recording contains what was played")
_SAME_RATE = 1e-9
_SAME_SCALE = 1e-6


class FilePlayer:
    """A `Digitizer` that returns the volts of a recording, from its first sample at every start.

    ``daq.options.recording`` is its path. When the recording's plan is run, its check and segments have the
    same sample numbers as in the recording; ``generator.driver = "file"`` accepts the plan's commands.
    """

    waiting_samples = 0
    """Zero, because a recording can be read at any speed."""

    def __init__(self, recording: Recording, channels: tuple[Channel, ...]) -> None:
        self._recording = recording
        self.sample_rate_hz = recording.sample_rate_hz
        """Sample rate of the replayed recording [1/s]."""
        self.roles = tuple(channel.role.value for channel in channels)
        """Roles of the channels, in the row order of a block."""
        self._next_sample = 0
        self._is_running = False
        self._is_open = True

    @classmethod
    def open(cls, rig: Rig) -> Self:
        """Open the recording; raises ConfigurationError if its seal, a channel, scale or rate is wrong."""
        path = rig.daq.options.get("recording")
        if not isinstance(path, str):
            raise ConfigurationError(
                'daq.driver = "file" plays back a recording, but the configuration names no recording; give '
                'daq.options.recording = "PATH.h5"'
            )
        with ExitStack() as opening:
            recording = opening.enter_context(open_recording(Path(path)))
            seal = recording.check_seal(SealDepth.WHOLE)
            if seal.state in (SealState.DAMAGED, SealState.SEAL_GONE):
                raise ConfigurationError(
                    f"{path} is damaged ({seal.sentence}), but a new file made from it would have an intact "
                    "seal. Nothing was played back; restore the recording from a copy"
                )
            channels = channels_of(rig)
            roles = [each.role.value for each in channels]
            rate_hz, requested_hz = recording.sample_rate_hz, rig.daq.sample_rate_hz
            if set(roles) - set(recording.roles) or abs(rate_hz - requested_hz) > _SAME_RATE * rate_hz:
                raise ConfigurationError(
                    f"{path} has {', '.join(recording.roles)} at {rate_hz:.12g} samples a second; the "
                    f"configuration has {', '.join(roles)} at {requested_hz:.12g}. Make channels and rate "
                    "agree"
                )
            for role, channel in zip(roles, channels, strict=True):
                made_with = recording.channel(role).physical_per_volt
                if abs(made_with - channel.units_per_volt) > _SAME_SCALE * abs(made_with):
                    raise ConfigurationError(
                        f"{path} was recorded with {made_with:.6g} units of {role} per volt, but sensor and "
                        f"attenuation of the configuration give {channel.units_per_volt:.6g}; copy both from "
                        "the bench on which it was recorded"
                    )
            opening.pop_all()
        return cls(recording, channels)

    @property
    def identity(self) -> Identity:
        """Identifier of the recording, and whether it was measured or simulated."""
        made = self._recording
        reply = f"{made.path.name}, recorded {made.started_utc}, {made.origin.value}"
        return Identity("", "recording", made.recording_id, "", reply, origin=made.origin.value)

    @property
    def volts_per_count(self) -> tuple[float | None, ...]:
        """Converter step of each channel in the recording [V]; None if a count of zero is not zero volts."""
        heads = (self._recording.channel(role) for role in self.roles)
        return tuple(None if head.volts_at_zero_count else head.volts_per_count for head in heads)

    def start(self) -> None:
        """Start returning samples, from the recording's first sample."""
        if not self._is_open or self._is_running:
            raise InstrumentError(
                "the recording is closed, or already playing; open the bench again, or stop playing"
            )
        self._is_running, self._next_sample = True, 0

    def read(self, samples: int) -> Block:
        """Return the next samples.

        Raises InstrumentLost at the end of the recording, DataLost at a gap in the recording.
        """
        if not self._is_running or samples < 1:
            raise InstrumentError(
                f"{samples} samples were requested from a recording that is not playing; start the recording"
            )
        first, last = self._next_sample, self._next_sample + samples
        if last > self._recording.samples:
            self._is_running = False
            raise InstrumentLost(
                f"{self._recording.path.name} ends after {self._recording.samples} samples, but sample "
                f"{last} was requested; play it back with the plan of the recording"
            )
        volts = np.stack([self._volts(role, first, last) for role in self.roles])
        if np.isnan(volts).any():
            self._is_running = False
            raise DataLost(
                f"{self._recording.path.name} has lost samples between {first} and {last}; a recording with "
                "missing samples cannot be played back"
            )
        self._next_sample = last
        overloads = tuple(
            Overload(each.channel, max(each.first_sample, first), min(each.last_sample, last - 1))
            for each in self._recording.overloads
            if each.channel in self.roles and each.first_sample < last and each.last_sample >= first
        )
        return Block(first, volts, overloads)

    def stop(self) -> None:
        """Stop returning samples. May be called at any time."""
        self._is_running = False

    def close(self) -> None:
        """Close the recording. May be called at any time."""
        self._is_running = self._is_open = False
        self._recording.close()

    def _volts(self, role: str, first: int, last: int) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        head = self._recording.channel(role)
        values = self._recording.read(role, first, last)
        return np.asarray((values - head.physical_offset) / head.physical_per_volt, dtype=np.float64)
