"""From one recording to its result, by what was played."""

from pathlib import Path

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
from vibench.acquisition.recording import Recording, open_recording

from ..errors import AnalysisError
from ..frequency_response import DEFAULT_REQUEST, FrequencyResponseRequest, NoiseAnalysis, noise_response
from ..recordings import (
    Channels,
    ObservedChannels,
    ProgressObserver,
    RecordedChannels,
    RecordingFacts,
    Unobserved,
    measurement_checks,
    recording_facts,
    require_moving_channels,
)
from ..sine import (
    DwellAnalysis,
    SteppedSineAnalysis,
    SweepAnalysis,
    bound_frequencies_hz,
    collisions,
    dwell_motion,
    measured_dwell,
    measured_sweep,
    settled_envelope,
    smooth_jumps,
    stepped_response,
    terminal_levels,
)

UNOBSERVED = Unobserved()
RecordingAnalysis = NoiseAnalysis | SweepAnalysis | DwellAnalysis | SteppedSineAnalysis


def analyse(
    recording: Recording | Path,
    request: FrequencyResponseRequest = DEFAULT_REQUEST,
    observer: ProgressObserver = UNOBSERVED,
) -> RecordingAnalysis:
    """Analyse a recording, complete or not, by the excitation that its plan names.

    Parameters
    ----------
    recording
        Open, or the path of its file. Finished, interrupted or still growing: what it held when it was opened
        is analysed.
    request
        How the transmission of noise is estimated; other excitations take no notice.
    observer
        Told how far it is.

    Raises
    ------
    AnalysisError
        With one sentence that names the file, when nothing in it is usable.

    """
    if isinstance(recording, Path):
        with open_recording(recording) as opened:
            return analyse(opened, request, observer)
    name = recording.path.name
    observer.begin(name, "looking at every channel")
    facts = recording_facts(recording, observer.read)
    observer.begin(name, "analysing")
    try:
        return _analysed(facts, ObservedChannels(RecordedChannels(recording), observer), request)
    except AnalysisError as error:
        ended = f"{facts.state.value}" + (f": {facts.reason}" if facts.reason else "")
        raise type(error)(f"{recording.path.name} ({ended}): {error}") from error


def _analysed(
    facts: RecordingFacts, channels: Channels, request: FrequencyResponseRequest
) -> RecordingAnalysis:
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
