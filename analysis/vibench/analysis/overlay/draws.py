"""Draws: simulated runs of rig and specimen, driven by a recorded voltage, with random start and noise."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from threading import Lock
from typing import ClassVar, Generic, TypeVar

import numpy as np
import scipy
from scipy import fft
from scipy.optimize import brentq

from vibench.acquisition.plan import Measurement
from vibench.acquisition.recording import BridgedChannel, Recording
from vibench.sim import Accuracy, Specimen
from vibench.sim.shaker.loaded_shaker import MotionFailed
from vibench.sim.shaker.sampled_voltage import SampledMotion, follow_voltage

from ..errors import UnusableData
from ..recordings.channels import BASE, VELOCITY, RecordedChannels, alignment_error_s, noise_as_read
from ..signals import Complexes, Reals, Samples
from ..sine.dwell import silence_before
from .driven_rig import (
    Driven,
    DrivenRig,
    FittedShaker,
    SimulatedChannels,
    acceleration_per_volt,
    advance,
    base_band_hz,
    carried_mass,
    driven_rig,
    recorded_voltage,
    under_base_motion,
)
from .ensemble import FEWEST_DRAWS, Ending, EnsembleCurve, Quantity, ensemble_curves

_FEWEST_LINES = 50
"""Minimum number of spectral lines in silence; this number determines the noise level within 25 %."""
_BLOCK_S = 0.05
_BLOCKS = 200
"""Number of blocks in which noise is estimated, in addition to the first 1 s and the last 1 s."""
_BAND = (0.2, 0.4)
"""Frequency band, relative to the sample rate, that contains channel noise but no modes."""
_ALIKE = 6.0
"""A block is quiet if its power exceeds the lowest power by at most this many standard deviations."""


@dataclass(frozen=True)
class ChannelNoise:
    """White noise of each channel, rms per sample in its physical unit."""

    rms: dict[str, float]
    converter_v: float
    """Smallest noise of all inputs [V], taken as the noise of the converter."""


def channel_noise(recording: Recording, roles: tuple[str, ...]) -> ChannelNoise:
    """Return the noise in the quietest part of each channel; recordings start in silence."""
    rate, samples = recording.sample_rate_hz, recording.samples
    length = max(16, round(_BLOCK_S * rate))
    ends = np.concatenate([np.arange(0, rate, length), samples - np.arange(length, rate + length, length)])
    starts = np.unique(np.concatenate([ends, np.linspace(0, samples - length, _BLOCKS)]).astype(int))
    starts = starts[(starts >= 0) & (starts <= samples - length)]
    rms = {
        role: _quiet([_white(recording.read(role, int(at), int(at) + length)) for at in starts], length)
        for role in roles
    }
    volts = [rms[role] / abs(recording.channel(role).physical_per_volt) for role in roles]
    return ChannelNoise(rms, min(volts))


def _quiet(rms: list[float], length: int) -> float:
    """Return the rms noise over all quiet blocks; the quietest block alone is a few per cent too low."""
    if not rms:
        return 0.0
    power = np.square(rms)
    lines = (_BAND[1] - _BAND[0]) * length
    alike = power <= power.min() * (1.0 + _ALIKE / np.sqrt(lines))
    return float(np.sqrt(np.mean(power[alike]))) if np.isfinite(power.min()) else float(np.inf)


def _white(samples: Reals) -> float:
    """Return the rms of the white noise, from the band above all modes; infinite if samples were lost."""
    if np.isnan(samples).any():
        return np.inf
    taper = np.hanning(samples.size)
    power = np.abs(np.fft.rfft(samples * taper)) ** 2
    low, high = (round(part * samples.size) for part in _BAND)
    # The mean power of a bin is the variance times the sum of the squared taper.
    return float(np.sqrt(np.mean(power[low:high]) / np.sum(taper**2)))


_COMPARED_HZ = (100.0, 2000.0)
"""Band in which drive noise is visible in the base motion, below further resonances of a table [Hz]."""
_MEDIAN_SD = 1.44
"""sqrt(N) times the relative standard deviation of the median of N exponentially distributed values."""
_HANN_LINES = 1.5
"""Number of spectral lines per statistically independent line, with a Hann window."""
UNKNOWN_NOISE = (
    "The noise of the amplifier is unknown, because neither its voltage nor a silence in a bench check was "
    "recorded; bands of simulated weak motion may be too narrow"
)


@dataclass(frozen=True)
class UnseenNoise:
    """White noise that moves the table but is absent from the recorded voltage; expressed as a voltage."""

    power: float = 0.0
    """Variance of one sample of the noise [V²]."""
    sd: float = 0.0
    """Standard deviation of the estimated variance [V²]."""

    def random_rms_v(self, rng: np.random.Generator) -> float:
        """Return a random rms noise per sample, within the uncertainty of the noise [V]."""
        return float(np.sqrt(max(0.0, self.power + self.sd * rng.standard_normal()))) if self.sd else 0.0


def unseen_noise(
    channels: RecordedChannels, rig: DrivenRig, noise: ChannelNoise
) -> tuple[UnseenNoise, ChannelNoise] | None:
    """Return the noise of an amplifier whose output is not recorded; None without enough silence.

    In silence, the motion due to the recorded voltage is subtracted from the recorded base motion. The rest
    is noise of amplifier, converter and sensor. The median over lines ignores hum. The second result is the
    channel noise without the amplifier's contribution.
    """
    if rig.driven is Driven.AMPLIFIER:
        return UnseenNoise(), noise
    volts, base, _ = silence_before(channels)
    cycles = np.fft.rfftfreq(max(volts.size, 1))
    frequency_hz: Reals = np.asarray(cycles * channels.sample_rate_hz, dtype=np.float64)
    inside = (frequency_hz >= _COMPARED_HZ[0]) & (frequency_hz <= _COMPARED_HZ[1]) & (cycles < _BAND[1])
    lines = int(np.sum(inside))
    if lines < _FEWEST_LINES:
        return None
    gain, taper = _base_over_voltage(rig, frequency_hz), np.hanning(volts.size)
    seen_v, seen = (np.fft.rfft((each - each.mean()) * taper) for each in (volts, base))
    power = np.abs(seen - gain * seen_v)[inside] ** 2 / np.sum(taper**2)
    passed = np.abs(gain[inside]) ** 2
    passed_high = float(np.mean(np.abs(gain[(cycles >= _BAND[0]) & (cycles < _BAND[1])]) ** 2))
    physical_per_volt = {role: abs(channels.recording.channel(role).physical_per_volt) for role in noise.rms}
    own_v2 = (noise.converter_v * physical_per_volt[rig.role]) ** 2
    recorded_v2 = noise.rms[rig.role] ** 2 - own_v2
    floor = (noise.converter_v * physical_per_volt[BASE]) ** 2

    def sensor(unseen_v2: float) -> float:
        """Return the variance of the base's sensor noise, from the high band [m²/s⁴]."""
        return max(floor, noise.rms[BASE] ** 2 - passed_high * (recorded_v2 + unseen_v2))

    def excess(unseen_v2: float) -> float:
        """Return the median of (power / level), minus ln 2; the difference is 0 if the level is correct."""
        level = passed * (unseen_v2 + own_v2) + sensor(unseen_v2)
        return float(np.median(power / level) - np.log(2.0))

    most = float(np.max(power / passed)) / np.log(2.0)
    found = float(brentq(excess, 0.0, most)) if excess(0.0) > 0.0 > excess(most) else 0.0
    rest = sensor(found)
    sd = _MEDIAN_SD * np.sqrt(_HANN_LINES / lines) * (found + own_v2 + rest / float(np.median(passed)))
    without = replace(noise, rms={**noise.rms, BASE: float(np.sqrt(rest))})
    return UnseenNoise(found, float(sd)), without


def _base_over_voltage(rig: DrivenRig, frequency_hz: Reals) -> Complexes:
    """Return the recorded base acceleration per recorded voltage; 0 at 0 Hz."""
    table, above = rig.table, frequency_hz[1:]
    s: Complexes = np.asarray(2j * np.pi * above, dtype=np.complex128)
    moved = acceleration_per_volt(table.shaker, s, carried_mass(table.specimen, above))
    return np.concatenate(([0.0], table.amplifier.gain * table.base_sensor(above) * moved))


_FRAME_SAMPLES = 1 << 15
"""Frame length [samples], 0.5 to 1 s; long enough to separate the drive's lines from noise."""
_BATCH_FRAMES = 16
"""Number of frames per batch of about 10 MB."""
_LEVEL_LINES = 256
"""Number of lines whose median is the noise level; a few lines of the drive hardly change this level."""
_SURELY = 20.0
"""Ratio of a line's power to the noise level; noise alone exceeds this ratio once in 5e8 lines."""


class PlayedVoltage:
    """A recorded voltage, from which converter noise is removed as far as possible.

    Converter noise did not drive the shaker; simulating this noise would raise weak motions too much. In each
    line of each frame, a Wiener filter estimates the part that drove the shaker; the uncertain rest is random
    in each draw. Draws scatter by the uncertainty of this estimate, not by all of the converter noise.
    """

    def __init__(self, volts: Reals, converter_rms_v: float) -> None:
        self._samples, self._own_v = volts.size, converter_rms_v
        self._hop = min(_FRAME_SAMPLES, max(4, volts.size // 2)) // 2
        self._frames = 1 - (-volts.size // self._hop)
        """Number of frames, which overlap by half; the first and last extend by half beyond the signal."""
        self._window = np.hanning(2 * self._hop + 1)[:-1]
        self._likely: Samples = volts
        self._roots: list[Samples] = []
        if converter_rms_v > 0.0:
            self._likely, self._roots = self._parts(volts)

    def _parts(self, volts: Reals) -> tuple[Samples, list[Samples]]:
        """Return the filtered voltage and, for each batch, the square root of each line's kept fraction."""
        own = self._own_v**2 * float(np.sum(self._window**2))
        halves = self._window.reshape(2, self._hop)
        # With this synthesis window, half-overlapping frames add up to the signal.
        back = (halves / np.sum(halves**2, axis=0)).ravel()
        recorded = np.zeros((self._frames + 1, self._hop), np.float32)
        recorded.ravel()[self._hop : self._hop + volts.size] = volts
        roots: list[Samples] = []

        def likely(first: int, last: int) -> Samples:
            whole = np.concatenate([recorded[first:last], recorded[first + 1 : last + 1]], axis=1)
            lines = fft.rfft(whole * self._window)
            power = np.abs(lines) ** 2
            # The median of exponentially distributed powers is log 2 times their mean.
            level = np.concatenate(
                [
                    np.broadcast_to(np.median(each, axis=1, keepdims=True) / np.log(2.0), each.shape)
                    for each in np.array_split(power, max(1, power.shape[1] // _LEVEL_LINES), axis=1)
                ],
                axis=1,
            )
            total = np.maximum(level, own)
            share = np.where(power > _SURELY * total, 1.0, 1.0 - own / np.where(total > 0.0, total, 1.0))
            roots.append(np.sqrt(share, dtype=np.float16))
            return np.asarray(
                fft.irfft(share * lines, self._window.size, overwrite_x=True) * back, np.float32
            )

        return self._overlap_add(likely), roots

    def random_voltage(self, rng: np.random.Generator) -> Samples:
        """Return a random voltage compatible with the recording, shape (samples,) [V]."""
        if self._own_v == 0.0:
            return self._likely
        # The random parts of frames are independent: weights equal to the window's root preserve the power.
        fade = np.sqrt(self._window, dtype=np.float32)
        size = np.float32(self._own_v * np.sqrt(self._hop))
        roots = iter(self._roots)

        def random_frames(_first: int, _last: int) -> Samples:
            root = next(roots)
            lines = rng.standard_normal((*root.shape, 2), np.float32).view(np.complex64)[..., 0]
            lines *= size * root
            return np.asarray(fft.irfft(lines, self._window.size, overwrite_x=True) * fade)

        drawn = self._overlap_add(random_frames)
        drawn += self._likely
        return drawn

    def _overlap_add(self, frames: Callable[[int, int], Samples]) -> Samples:
        """Return the sum of half-overlapping frames; ``frames`` returns the frames of one batch."""
        hop = self._hop
        result = np.zeros((self._frames + 1, hop), np.float32)
        for first in range(0, self._frames, _BATCH_FRAMES):
            last = min(first + _BATCH_FRAMES, self._frames)
            whole = frames(first, last)
            result[first:last] += whole[:, :hop]
            result[first + 1 : last + 1] += whole[:, hop:]
        return result.ravel()[hop : hop + self._samples]


DRAWS, MOST_DRAWS = 16, 1000
"""Usual and maximum number of draws of a colliding motion; 16 draws determine the 95 % band to 20 %."""
FIRST_DRAWS = 8
"""Number of draws (simulated runs) computed first; enough if the agreement is clear or nothing collides."""
_FURTHER_DRAWS = 4
"""Number of draws between two checks of whether there are enough draws."""
START_M = 5e-9
"""Standard deviation of each mass's initial position [m]."""
CLOCK_TOLERANCE = 50e-6
"""Relative error of the converter clock (NI 9234), which shifts resonances."""
_LEAD_S, _FADE_S, _TAIL_S = 0.5, 0.2, 0.05
"""Lead-in before the evaluated part, fade-in at the start of the lead-in, fade-out after the part [s]."""
_NOISE = 0.15
"""Uncertainty of ln(noise of a channel); the noise is estimated in the channel's quietest part."""
_MORE = 3
_HOPELESS = 0.2
"""Stop if the probability of reaching enough draws for a comparison is smaller than this."""
_SEED = 17
_BLOCK = 1 << 17
"""Number of samples per block of added noise."""
_MOST_BYTES = 0.35e9
"""Memory for draws that run in parallel [bytes]."""
_BYTES_PER_SAMPLE = 16


@dataclass(frozen=True, eq=False)
class SimulatedRun:
    """Specimen, drive, accuracy and impacts of the simulation of a recording."""

    DOCUMENT: ClassVar = (
        "drive=driven why draws base_band_hz accuracy masses_kg=specimen.masses "
        "stiffnesses_n_per_m=specimen.stiffnesses dampings_ns_per_m=specimen.dampings "
        "gap_m=smaller_gap_m gaps_m=specimen.gaps_m impacts impact_rate_hz"
    )

    specimen: Specimen
    driven: Driven
    accuracy: Accuracy
    """Accuracy of simulated contacts; always *standard* if a voltage drives the simulation."""
    base_band_hz: tuple[float, float] | None
    """Band of the base displacement that drives the specimen; None if a voltage drives it."""
    why: str = ""
    """Reason why the recorded voltage was not used, or remarks on the rig."""
    draws: int = 0
    impacts: float = 0.0
    """Mean number of contacts per draw during the analysed parts of the recording."""
    played_s: float = 0.0

    @property
    def smaller_gap_m(self) -> float:
        """Smaller gap of the two sides [m]."""
        return min(self.specimen.gaps_m)

    @property
    def impact_rate_hz(self) -> float:
        """Mean number of impacts per second."""
        return self.impacts / self.played_s if self.played_s else 0.0


R = TypeVar("R")


@dataclass(frozen=True, eq=False)
class Draw(Generic[R]):
    """One simulated run with random initial state and noise, analysed like the recording."""

    response: Callable[[], R]
    """Function that computes the complete response; comparisons need only ``quantities``."""
    quantities: tuple[Quantity, ...]
    endings: tuple[Ending, ...]
    impacts: float
    played_s: float


@dataclass(frozen=True, eq=False)
class DrawSet(Generic[R]):
    """All draws: the full estimate of the first draw, and every compared quantity, measured and drawn."""

    run: SimulatedRun
    response: R
    ensemble: tuple[EnsembleCurve, ...]
    endings: tuple[tuple[Ending, ...], ...]


@dataclass(frozen=True, eq=False)
class DrawSource:
    """Source of draws; the draw with a given number is always the same."""

    run: SimulatedRun
    """Properties of the simulation that are known before the first draw."""
    most: int
    samples: int
    channels: Callable[[int], SimulatedChannels]


def voltage_source(
    recording: Recording,
    specimen: Specimen,
    fitted: FittedShaker | None = None,
    draws: int = DRAWS,
) -> DrawSource:
    """Return a source of draws of rig and specimen, driven by the recorded voltage.

    Raises UnusableData when samples were lost or the shaker is unknown.

    Parameters
    ----------
    recording
        Recording; its bench configuration describes the rig.
    fitted
        A shaker to use instead of the described one; each draw varies this shaker within its uncertainty.
    draws
        Maximum number of draws.
    """
    rig = driven_rig(recording, specimen, None if fitted is None else fitted.shaker)
    volts = recorded_voltage(recording, rig)
    noise = channel_noise(recording, tuple(recording.roles))
    voltage = PlayedVoltage(volts, noise.converter_v * abs(recording.channel(rig.role).physical_per_volt))
    channels = RecordedChannels(recording)
    known = unseen_noise(channels, rig, noise)
    unseen, noise = known or (UnseenNoise(), noise)
    why = ["" if fitted is None else fitted.sentence, "" if known else UNKNOWN_NOISE]
    run = SimulatedRun(specimen, rig.driven, Accuracy.STANDARD, None, ". ".join(filter(None, why)))
    drawn_channels = partial(_random_channels, recording, rig, fitted, voltage, noise, unseen)
    return DrawSource(run, draws, recording.samples, drawn_channels)


def base_source(
    recording: Recording, measurement: Measurement, specimen: Specimen, why: str = ""
) -> DrawSource:
    """Return a source of one draw driven by the recorded base motion, for linear and coherent motion."""
    channels = under_base_motion(recording, measurement, specimen)
    band_hz = base_band_hz(recording, measurement)
    run = SimulatedRun(specimen, Driven.BASE, Accuracy.STANDARD, band_hz, why)
    return DrawSource(run, 1, channels.samples, lambda _: channels)


def all_draws(
    source: DrawSource, estimate: Callable[[SimulatedChannels], Draw[R]], measured: Sequence[Quantity]
) -> DrawSet[R]:
    """Return all draws of a source, each analysed like the recording.

    Fewer draws are made if the first draws clearly agree with the recording. Up to three times as many draws
    are made if few of them show the ``measured`` kind of motion, unless enough such draws are improbable.
    Raises UnusableData when a simulation did not finish.
    """
    responses: list[R] = []

    estimating = Lock()

    def estimate_draw(number: int) -> Draw[None]:
        channels = source.channels(number)
        # Compute only one estimate at a time: estimates take at most half of the time, but double the memory.
        with estimating:
            draw = estimate(channels)
            if number == 0:
                responses.append(draw.response())
        return Draw(lambda: None, draw.quantities, draw.endings, draw.impacts, draw.played_s)

    workers = max(1, min(os.cpu_count() or 1, int(_MOST_BYTES / (_BYTES_PER_SAMPLE * source.samples))))
    with ThreadPoolExecutor(workers) as pool:
        found = list(pool.map(estimate_draw, range(min(FIRST_DRAWS, source.most))))
        usual = source.most if found[0].impacts else len(found)
        most = usual if source.most == 1 else _MORE * usual
        while len(found) < most:
            curves = ensemble_curves(measured, [each.quantities for each in found])
            alike = float(np.median(np.concatenate([each.count for each in curves])))
            # If more draws than the default were requested, they serve narrower bands: compute all of them.
            if alike < FEWEST_DRAWS:
                if _chance_of_enough(alike, len(found), most) < _HOPELESS:
                    break
            elif len(found) >= usual or (usual <= DRAWS and all(each.agrees_clearly for each in curves)):
                break
            stop = min(len(found) + _FURTHER_DRAWS, usual if len(found) < usual else most)
            found += pool.map(estimate_draw, range(len(found), stop))
    impacts = float(np.mean([each.impacts for each in found]))
    run = replace(source.run, draws=len(found), impacts=impacts, played_s=found[0].played_s)
    ensemble = ensemble_curves(measured, [each.quantities for each in found])
    return DrawSet(run, responses[0], ensemble, tuple(each.endings for each in found))


def _chance_of_enough(alike: float, made: int, most: int) -> float:
    """Return the chance that `FEWEST_DRAWS` of ``most`` draws are alike, if ``alike`` of ``made`` were."""
    further = scipy.stats.betabinom(most - made, 1 + alike, 1 + made - alike)
    return float(further.sf(FEWEST_DRAWS - alike - 1))


def _random_channels(
    recording: Recording,
    rig: DrivenRig,
    fitted: FittedShaker | None,
    voltage: PlayedVoltage,
    noise: ChannelNoise,
    unseen: UnseenNoise,
    number: int,
) -> SimulatedChannels:
    rng = np.random.default_rng([_SEED, number])
    table = rig.table if fitted is None else replace(rig.table, shaker=fitted.random_shaker(rng))
    volts = voltage.random_voltage(rng)
    rms_v = unseen.random_rms_v(rng)
    if rms_v > 0.0:
        volts = _with_noise(volts.copy(), rig.role, rms_v, recording.sample_rate_hz, rng)
    motion = _simulate_motion(replace(rig, table=table), volts, recording, noise, rng)
    velocity, error_s = motion.m0_velocity, alignment_error_s(recording, BASE, rig.response)
    if error_s > 0.0:  # times with few digits align the channels inexactly
        by_samples = error_s * rng.uniform(-1.0, 1.0) * recording.sample_rate_hz
        velocity = advance(velocity.astype(np.float64), by_samples).astype(np.float32)
    return SimulatedChannels(
        recording,
        velocity=velocity,
        impacts_at_s=(motion.impact_times_s, motion.impacts),
        base_acceleration=motion.base_acceleration,
        has_sensors=True,
    )


def _simulate_motion(
    rig: DrivenRig, volts: Samples, recording: Recording, noise: ChannelNoise, rng: np.random.Generator
) -> SampledMotion:
    """Simulate rig and specimen from a random initial state, with noise on the channels of base and m0."""
    try:
        motion = follow_voltage(
            rig.table,
            volts,
            recording.sample_rate_hz * (1 + CLOCK_TOLERANCE * rng.uniform(-1.0, 1.0)),
            start=np.concatenate([START_M * rng.standard_normal(3), np.zeros(3)]),
        )
    except MotionFailed as error:
        raise UnusableData(f"the simulation from the {rig.driven.value} ended: {error}") from error
    for role, seen in ((BASE, motion.base_acceleration), (rig.response, motion.m0_velocity)):
        _with_noise(seen, role, noise.rms[role], recording.sample_rate_hz, rng)
    return motion


def _with_noise(samples: Samples, role: str, rms: float, rate_hz: float, rng: np.random.Generator) -> Samples:
    """Add the noise of a channel in place, converted as in an analysis (for a mass, to a velocity)."""
    first = 0
    for block in noise_as_read(role, rate_hz, samples.size, _BLOCK, rng):
        samples[first : first + block.size] += np.float32(rms) * block
        first += block.size
    return samples


@dataclass(frozen=True, eq=False)
class StretchDraws:
    """Source of draws of one part of a recording, for any specimen; used for statistics of irregular motion.

    A run starts from rest half a second before this part, with the recorded voltage faded in.
    """

    recording: Recording
    rig: DrivenRig
    fitted: FittedShaker | None
    noise: ChannelNoise
    volts: Reals
    """Recorded voltage without the noise of its channel."""
    first: int
    """Index of the first sample of ``volts``, counted from the start of the recording."""
    kept: slice
    """Slice of ``volts`` with the simulated part of the recording."""

    @property
    def recorded_motion(self) -> Reals:
        """Recorded base acceleration and velocity of m0 over the samples of a draw, shape (2, samples)."""
        start, stop = (self.first + each for each in (self.kept.start, self.kept.stop))
        velocity = BridgedChannel(self.recording, VELOCITY).read(start, stop)
        return np.stack([self.recording.read(BASE, start, stop), velocity])

    @property
    def noise_rms(self) -> Reals:
        """White noise of base acceleration [m/s2] and m0's velocity [m/s], per sample."""
        return np.array([self.noise.rms[role] for role in (BASE, VELOCITY)])

    def draw(self, specimen: Specimen, rng: np.random.Generator) -> Reals:
        """Return base acceleration [m/s2] and m0's velocity [m/s] of a run with noise, shape (2, samples).

        Raises UnusableData when the simulation did not reach its end.
        """
        shaker = self.rig.table.shaker if self.fitted is None else self.fitted.random_shaker(rng)
        rig = replace(self.rig, table=replace(self.rig.table, shaker=shaker, specimen=specimen))
        rms = {role: each * np.exp(rng.uniform(-1, 1) * _NOISE) for role, each in self.noise.rms.items()}
        noise = ChannelNoise(rms, self.noise.converter_v)
        motion = _simulate_motion(rig, self.volts, self.recording, noise, rng)
        return np.stack(
            [motion.base_acceleration[self.kept], motion.m0_velocity[self.kept]], dtype=np.float64
        )


def stretch_draws(
    recording: Recording, specimen: Specimen, start: int, stop: int, fitted: FittedShaker | None = None
) -> StretchDraws:
    """Return a source of draws driven by the recorded voltage from sample ``start`` to ``stop``.

    Near the end of the recording, the stretch is shortened to leave 50 ms for the fade-out.

    Raises UnusableData when samples were lost, the shaker is unknown, or m0's channel is not a velocity:
    the noise of an integrated channel is not white.
    """
    if VELOCITY not in recording.roles:
        raise UnusableData(
            f"statistics of irregular motion need the channel {VELOCITY}, whose noise is white; this "
            f"recording has {', '.join(recording.roles)}; measure with a vibrometer"
        )
    rig = driven_rig(recording, specimen, None if fitted is None else fitted.shaker)
    rate = recording.sample_rate_hz
    first, last = max(0, start - round(_LEAD_S * rate)), min(recording.samples, stop + round(_TAIL_S * rate))
    stop = min(stop, last - round(_TAIL_S * rate))
    volts = recorded_voltage(recording, rig, first, last)
    for end, fade_s in ((volts, _FADE_S), (volts[::-1], _TAIL_S)):
        fade = min(volts.size, round(fade_s * rate))
        end[:fade] *= 0.5 - 0.5 * np.cos(np.pi * np.arange(fade) / fade)
    noise = channel_noise(recording, (rig.role, BASE, VELOCITY))
    # Keep only spectral lines far above the channel's noise, which would otherwise drive the simulation.
    spectrum = np.fft.rfft(volts)
    spectrum[np.abs(spectrum) ** 2 < _SURELY * volts.size * noise.rms[rig.role] ** 2] = 0.0
    played = np.asarray(np.fft.irfft(spectrum, volts.size))
    return StretchDraws(recording, rig, fitted, noise, played, first, slice(start - first, stop - first))
