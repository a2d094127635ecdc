"""The specimen simulated under the base motion that was recorded, in the shape of a recording."""

from dataclasses import dataclass

import numpy as np

from acquisition.measurement import Measurement
from acquisition.recording import Recording
from sim.accuracy import Accuracy
from sim.drive import Sampled
from sim.integrate import integrate
from sim.outcome import Outcome
from sim.specimen import Specimen

from .arrays import Reals
from .base_motion import RecordedBaseMotion, recorded_base_motion
from .errors import UnusableData
from .recorded_channels import BASE, Channels, RecordedChannels, Stretch

_PIECE_S = 5.0
"""Simulated at a time: bounds the memory of a long recording."""
_OVERLAP = 48
"""Samples on either side of a piece: a spline forgets its ends by a factor of 0.27 per sample (1e-27)."""
_VX = 3


@dataclass(frozen=True, eq=False)
class SimulatedSpecimen:
    """What the specimen did under a recorded base motion."""

    specimen: Specimen
    accuracy: Accuracy
    base: RecordedBaseMotion
    velocity: Reals
    """Of m0 on the recording's sample grid, without sensor delay or noise, shape (samples,) [m/s]."""
    impact_times_s: Reals
    """Since the first sample of the recording; ascending."""

    def impacts_between(self, start_s: float, stop_s: float) -> int:
        """Count the contacts that began in a stretch of time."""
        return int(np.diff(np.searchsorted(self.impact_times_s, (start_s, stop_s)))[0])


def simulated_specimen(
    recording: Recording,
    measurement: Measurement,
    specimen: Specimen,
    accuracy: Accuracy = Accuracy.STANDARD,
) -> SimulatedSpecimen:
    """Shake a specimen, from rest, by the base motion of a whole recording, at its full sample rate.

    Nothing is decimated: an interval between samples costs a fraction of a microsecond.

    Raises
    ------
    UnusableData
        When samples were lost, or the simulation did not reach the end.

    """
    base = recorded_base_motion(recording, measurement)
    velocity, impacts = shaken(specimen, base.displacement_m, base.sample_rate_hz, accuracy)
    return SimulatedSpecimen(specimen, accuracy, base, velocity, impacts)


def shaken(
    specimen: Specimen, displacement_m: Reals, sample_rate_hz: float, accuracy: Accuracy
) -> tuple[Reals, Reals]:
    """Give m0's velocity at every sample of the base's displacement, and the times of all impacts."""
    count = displacement_m.size
    velocity = np.zeros(count)
    impacts: list[Reals] = []
    state = np.zeros(6)
    piece = round(_PIECE_S * sample_rate_hz)
    for first in range(0, count - 1, piece):
        last = min(first + piece, count - 1)
        before = min(_OVERLAP, first)
        part = displacement_m[first - before : last + 1 + _OVERLAP]
        path = integrate(
            specimen,
            Sampled(part, sample_rate_hz),
            (last - first) / sample_rate_hz,
            accuracy,
            state,
            sample_rate_hz,
            start_time_s=before / sample_rate_hz,
        )
        if path.outcome is not Outcome.REACHED_END:
            raise UnusableData(
                f"the simulation under the recorded base motion ended after {first / sample_rate_hz:.3g} s "
                f"or later: {path.outcome.text}"
            )
        velocity[first : last + 1] = path.states[: last + 1 - first, _VX]
        impacts.append(path.impacts.times_s + (first - before) / sample_rate_hz)
        state = path.final_state
    return velocity, np.concatenate([*impacts, np.empty(0)])


@dataclass(frozen=True, eq=False)
class SimulatedChannels:
    """Drive and base as they were recorded, the response as simulated: the same estimator takes both."""

    recorded: RecordedChannels
    simulated: SimulatedSpecimen

    @property
    def sample_rate_hz(self) -> float:
        """Of all channels."""
        return self.recorded.sample_rate_hz

    @property
    def samples(self) -> int:
        """Samples per channel."""
        return self.recorded.samples

    @property
    def response_delay_s(self) -> float:
        """The simulated response has no delay; the recorded base may have one."""
        return -self.recorded.recording.channel(BASE).delay_s

    def stretches(self, label: str) -> tuple[Stretch, ...]:
        """Give the named parts of the record."""
        return self.recorded.stretches(label)

    def read(self, start: int, stop: int) -> Reals:
        """Give drive, base acceleration and simulated velocity, shape (3, samples)."""
        data = self.recorded.read(start, stop)
        data[2] = self.simulated.velocity[start:stop]
        return data


def played_impacts(channels: Channels, simulated: SimulatedSpecimen, label: str) -> tuple[int, float]:
    """Count impacts inside the stretches of one label, and give the time those took [s]."""
    rate = channels.sample_rate_hz
    stretches = channels.stretches(label)
    count = sum(simulated.impacts_between(each.start / rate, each.stop / rate) for each in stretches)
    return count, sum(each.samples for each in stretches) / rate
