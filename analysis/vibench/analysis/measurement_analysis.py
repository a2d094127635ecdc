"""From one recording to its result, by what was played."""

from dataclasses import dataclass

import numpy as np

from vibench.acquisition.plan import (
    Dwell,
    HeldDwell,
    HeldSweep,
    MultisineNoise,
    OddMultisine,
    ResonanceTracking,
    SettledSine,
    SineSweep,
    SteppedLevel,
    SteppedSine,
    StreamedNoise,
)
from vibench.acquisition.recording import Recording

from .channel_faults import require_moving_channels
from .collision_region import Collisions, collisions
from .dwell import DwellResponse, dwell_response
from .dwell_motion import DwellMotion, dwell_motion
from .envelope import Envelope, envelope
from .errors import AnalysisError, NotEnoughData
from .jumps import Jump, jumps
from .measurement_checks import Check, measurement_checks
from .noise_request import NoiseRequest
from .noise_response import DEFAULT_REQUEST, Noise, NoiseResponse, noise_response
from .recorded_channels import Channels, RecordedChannels, only_stretch, read_whole
from .recording_facts import RecordingFacts, recording_facts, specimen_of
from .spectrogram import Spectrogram, SpectrogramSums
from .stepped_response import SteppedResponse, Steps, stepped_response
from .sweep import SweepResponse, SweepSums
from .terminal_level import TerminalLevel, terminal_levels
from .watcher import Unwatched, WatchedChannels, Watcher

WINDOW_S = 5.0
"""The paper's window: the last 5 s of a dwell."""
_DWELL_EDGE_PERIODS = 121
"""Drive periods that integration disturbs, both ends together."""
_SHORTEST_WINDOW_PERIODS = 50
_BLOCK = 1 << 20
_RESPONSE = 2
_SPECTROGRAM_ORDER = 3.2
"""A spectrogram shows the drive's third harmonic at the sweep's end."""
_TIME_BINS = 1200
UNWATCHED = Unwatched()


@dataclass(frozen=True, eq=False)
class NoiseAnalysis:
    """A noise measurement: transmission base to m0."""

    facts: RecordingFacts
    checks: tuple[Check, ...]
    excitation: Noise
    response: NoiseResponse
    request: NoiseRequest
    """What was asked for."""


@dataclass(frozen=True, eq=False)
class SweepAnalysis:
    """A sweep: envelope, responses and where the masses collide."""

    facts: RecordingFacts
    checks: tuple[Check, ...]
    excitation: SineSweep | HeldSweep
    response: SweepResponse
    collisions: Collisions
    jumps: tuple[Jump, ...]
    """Of Response II, between a smooth motion and another."""
    spectrogram: Spectrogram
    """Of the recorded velocity."""


@dataclass(frozen=True, eq=False)
class DwellAnalysis:
    """A dwell: time signal, spectrum, responses and lines."""

    facts: RecordingFacts
    checks: tuple[Check, ...]
    excitation: Dwell | HeldDwell
    response: DwellResponse
    displacement: Envelope
    """x over the dwell [m], without the ends that integration disturbs."""
    terminal: tuple[TerminalLevel, ...]
    """How much of the motion went to the bands of the bound modes."""
    motion: DwellMotion
    """How it repeats."""


@dataclass(frozen=True, eq=False)
class SteppedSineAnalysis:
    """A stepped sine: responses at every frequency, or at every level."""

    facts: RecordingFacts
    checks: tuple[Check, ...]
    excitation: Steps
    response: SteppedResponse


RecordingAnalysis = NoiseAnalysis | SweepAnalysis | DwellAnalysis | SteppedSineAnalysis


def analyse_recording(
    recording: Recording, request: NoiseRequest = DEFAULT_REQUEST, watcher: Watcher = UNWATCHED
) -> RecordingAnalysis:
    """Analyse a recording, complete or not, by the excitation that its plan names.

    Parameters
    ----------
    recording
        Finished, interrupted or still growing: what it held when it was opened is analysed.
    request
        How the transmission of noise is estimated; other excitations take no notice.
    watcher
        Told how far it is.

    Raises
    ------
    AnalysisError
        With one sentence that names the file, when nothing in it is usable.

    """
    name = recording.path.name
    watcher.begin(name, "looking at every channel")
    facts = recording_facts(recording, watcher.read)
    watcher.begin(name, "analysing")
    try:
        return _analysed(facts, WatchedChannels(RecordedChannels(recording), watcher), request)
    except AnalysisError as error:
        ended = f"{facts.state.value}" + (f": {facts.reason}" if facts.reason else "")
        raise type(error)(f"{recording.path.name} ({ended}): {error}") from error


def _analysed(facts: RecordingFacts, channels: Channels, request: NoiseRequest) -> RecordingAnalysis:
    checks = measurement_checks(facts)
    require_moving_channels(facts.channels)
    match facts.measurement.excitation:
        case MultisineNoise() | OddMultisine() | StreamedNoise() as noise:
            return NoiseAnalysis(facts, checks, noise, noise_response(channels, noise, request), request)
        case SineSweep() | HeldSweep() as sweep:
            response, picture = measured_sweep(channels, sweep)
            colliding = collisions(response)
            return SweepAnalysis(
                facts, checks, sweep, response, colliding, smooth_jumps(response, colliding), picture
            )
        case Dwell() | HeldDwell() as dwell:
            towards_hz = bound_frequencies_hz(facts)
            found = measured_dwell(channels, dwell, towards_hz)
            terminal = terminal_levels(found, towards_hz)
            motion = dwell_motion(channels, found)
            return DwellAnalysis(facts, checks, dwell, found, settled_envelope(found), terminal, motion)
        case SteppedSine() | SteppedLevel() | SettledSine() | ResonanceTracking() as stepped:
            return SteppedSineAnalysis(facts, checks, stepped, stepped_response(channels, stepped))


def bound_frequencies_hz(facts: RecordingFacts) -> tuple[float, ...]:
    """Frequencies of the specimen with m1 stuck to m2: where strong collisions move the motion to."""
    return tuple(float(each) for each in specimen_of(facts.bench).bound_frequencies_hz)


def smooth_jumps(response: SweepResponse, colliding: Collisions) -> tuple[Jump, ...]:
    """Find the jumps of Response II that have a smooth motion on one side."""
    return jumps(response.time_s, response.frequency_hz, response.response_ii, ~colliding.is_colliding)


def measured_sweep(channels: Channels, sweep: SineSweep | HeldSweep) -> tuple[SweepResponse, Spectrogram]:
    """Analyse what there is of a sweep, whichever way it ran, and picture its velocity."""
    stretch = only_stretch(channels, "sweep")
    ends = sorted((sweep.start_hz, sweep.stop_hz))
    rate = channels.sample_rate_hz
    sums = SweepSums(rate, low_hz=ends[0], high_hz=ends[1])
    highest_hz = min(_SPECTROGRAM_ORDER * ends[1], 0.5 * rate)
    picture = SpectrogramSums(rate, stretch.samples, highest_hz=highest_hz)
    for first in range(stretch.start, stretch.stop, _BLOCK):
        last = min(first + _BLOCK, stretch.stop)
        block = channels.read(first, last)
        if np.isnan(block).any():
            lost_s = (first - stretch.start) / channels.sample_rate_hz
            raise NotEnoughData(
                f"samples were lost after {lost_s:.3g} s of the sweep, and its phase cannot be followed "
                "across a hole; measure again"
            )
        sums.add(block)
        picture.add(block[_RESPONSE])
    return sums.response(delay_s=channels.response_delay_s), picture.spectrogram()


def measured_dwell(
    channels: Channels, dwell: Dwell | HeldDwell, towards_hz: tuple[float, ...]
) -> DwellResponse:
    """Analyse the last 5 s of a dwell, or what there is of them."""
    stretch = only_stretch(channels, "dwell")
    drive, base, response = read_whole(channels, stretch)
    rate = channels.sample_rate_hz
    clear_s = stretch.samples / rate - _DWELL_EDGE_PERIODS / dwell.frequency_hz
    if clear_s < _SHORTEST_WINDOW_PERIODS / dwell.frequency_hz:
        raise NotEnoughData(
            f"{stretch.samples / rate:.3g} s of the dwell were recorded; without the ends that integration "
            f"disturbs too little is left at {dwell.frequency_hz:g} Hz: measure longer"
        )
    return dwell_response(
        drive,
        base,
        response,
        rate,
        near_hz=dwell.frequency_hz,
        window_s=min(WINDOW_S, clear_s),
        towards_hz=towards_hz,
        delay_s=channels.response_delay_s,
    )


def settled_envelope(response: DwellResponse) -> Envelope:
    """Give x over the dwell as a plot shows it."""
    motion = response.displacement
    start_s = motion.edge_samples / motion.sample_rate_hz
    return envelope(motion.settled, motion.sample_rate_hz, bins=_TIME_BINS, start_s=start_s)
