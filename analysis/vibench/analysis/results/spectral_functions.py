"""Frequency response, coherence and spectral densities of a recording, for programs that read functions."""

from dataclasses import dataclass, replace

import numpy as np

from vibench.acquisition.plan import present_word
from vibench.acquisition.recording import ChannelHeader, SegmentLabel
from vibench.acquisition.rig import Role

from ..errors import NotEnoughData
from ..exchange import Excerpt, FunctionAxis, FunctionType, UniversalFunction
from ..frequency_response.noise_response import NoiseResponse
from ..frequency_response.request import FrequencyResponseRequest, FrequencyResponseView
from ..kinds.analyses import ANALYSES
from ..kinds.noise import NOISE_FAMILY
from ..recordings.facts import require_checked
from ..signals.quantity import Quantity
from ..signals.window import hop_samples
from ..spectra.spectra import DensitySums
from .measurement_analysis import analyse

_RESOLUTION_HZ = 1.0
"""Resolution of densities: segments of a second, Hann window, half overlapping."""
_OVERLAP = 0.5
_FEWEST_SAMPLES = 2
_AROUND = frozenset({SegmentLabel.CHECK, SegmentLabel.LEAD_IN, SegmentLabel.RAMP_UP, SegmentLabel.RAMP_DOWN})
"""What is recorded on the way to the plan and back; pauses and settling have no label."""
_UNITS = {Quantity.DISPLACEMENT: "m", Quantity.VELOCITY: "m/s", Quantity.ACCELERATION: "m/s2"}


def spectral_functions(excerpt: Excerpt, request: FrequencyResponseRequest) -> tuple[UniversalFunction, ...]:
    """Estimate what an excerpt holds as functions of frequency.

    The density of each of its channels over what of the plan was played in its stretch of time, by segments
    of a second, shorter where nothing was played so long; of noise also the frequency response from base to
    m0, over the whole recording as `analyse` estimates it, and its coherence.

    Parameters
    ----------
    excerpt
        Of a recording that is open.
    request
        How the frequency response is estimated, and of which quantities it is.

    Raises
    ------
    NotEnoughData
        When the excerpt holds no segment of what was played, or its analysis finds nothing.
    UnusableData
        When the recording is not as it was sealed.
    """
    require_checked(excerpt.recording)
    played = _played_parts(excerpt)
    densities = tuple(_density(played, channel) for channel in excerpt.channels)
    kind = present_word(excerpt.recording.plan.get("excitation", {}).get("kind", ""))
    if kind not in ANALYSES or ANALYSES[kind].family != NOISE_FAMILY:
        return densities
    return (*_responses(analyse(excerpt.recording, request).response, request.view), *densities)


def _responses(response: NoiseResponse, view: FrequencyResponseView) -> tuple[UniversalFunction, ...]:
    found = view.shown(response.frequency_response)
    moved = _axis(Role.M0_VELOCITY, "m0", view.response)
    reference = _axis(Role.BASE_ACCELERATION, "base", view.base)
    averages = f"{found.n_eff:.4g} averages over {response.used_s:.6g} s of the whole recording"
    note = f"estimator {found.settings.estimator.value}, {averages}"
    # A coherence has no unit: a program that turns metres into millimetres must leave it alone.
    bare, bare_reference = (replace(axis, quantity="", unit="NONE") for axis in (moved, reference))
    hz, kinds = found.frequency_hz, FunctionType
    return (
        UniversalFunction(kinds.FREQUENCY_RESPONSE, hz, found.value, moved, reference, note),
        UniversalFunction(kinds.COHERENCE, hz, found.coherence, bare, bare_reference, note),
    )


def _axis(role: Role, body: str, quantity: Quantity) -> FunctionAxis:
    return FunctionAxis(role.value, f"{body} {quantity.value}", quantity.value, _UNITS[quantity])


@dataclass(frozen=True, eq=False)
class _Played:
    """What of an excerpt is averaged over."""

    stretches: tuple[Excerpt, ...]
    """Each at least a segment long."""
    labels: tuple[str, ...]
    segment: int
    """Samples of each segment."""

    @property
    def note(self) -> str:
        """Over what, for people."""
        first, *_ = self.stretches
        seconds = sum(each.samples for each in self.stretches) / first.recording.sample_rate_hz
        return f"over {seconds:.6g} s of {' and '.join(self.labels)}"


def _played_parts(excerpt: Excerpt) -> _Played:
    """Find the parts of the plan; a recording without named parts is one."""
    recording = excerpt.recording
    rate = recording.sample_rate_hz
    parts = [(each.label, each.start, each.stop) for each in recording.segments if each.label not in _AROUND]
    if not recording.segments:
        parts = [("the recording", 0, recording.samples)]
    longest = max((stop - start for _, start, stop in parts), default=0)
    segment = min(round(rate / _RESOLUTION_HZ), longest)
    inside = [(label, max(start, excerpt.start), min(stop, excerpt.stop)) for label, start, stop in parts]
    used = [each for each in inside if each[2] - each[1] >= max(segment, _FEWEST_SAMPLES)]
    if not used:
        chosen_s = max((stop - start for _, start, stop in inside), default=0) / rate
        raise NotEnoughData(
            f"densities need {max(segment, _FEWEST_SAMPLES) / rate:.3g} s in one piece of what was played, "
            f"and {max(chosen_s, 0.0):.3g} s were chosen; choose more of it"
        )
    stretches = tuple(replace(excerpt, start=start, stop=stop) for _, start, stop in used)
    return _Played(stretches, tuple(dict.fromkeys(label for label, _, _ in used)), segment)


def _density(played: _Played, channel: ChannelHeader) -> UniversalFunction:
    first, *_ = played.stretches
    hop = hop_samples(played.segment, _OVERLAP)
    sums = DensitySums(first.recording.sample_rate_hz, segment_samples=played.segment, overlap=_OVERLAP)
    for each in played.stretches:
        for values in each.channel_blocks(channel.role):
            valid = np.isfinite(values)
            sums.add(np.where(valid, values, 0.0), valid)
        # No segment reaches from one stretch into the next, and one begins with the next.
        between = hop - each.samples % hop
        sums.add(np.zeros(between), np.zeros(between, dtype=np.bool_))
    found = sums.density()
    return UniversalFunction(
        FunctionType.DENSITY,
        found.frequency_hz,
        found.density,
        FunctionAxis(channel.role, channel.role, channel.quantity, f"({channel.unit})2/Hz"),
        FunctionAxis(),
        f"Hann window, {found.n_eff:.4g} averages {played.note}",
    )
