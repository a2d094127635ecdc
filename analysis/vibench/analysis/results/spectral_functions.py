"""Scans of several points, and the spectral functions of a recording, to export as functions.

Spectral functions are frequency response, coherence and spectral densities. A scan contains the transmissions
at several points of the specimen, and their deflection shapes at the resonances.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path

import numpy as np

from vibench.acquisition import open_recording
from vibench.acquisition.plan import ScanPoint
from vibench.acquisition.recording import ChannelHeader, SegmentLabel
from vibench.acquisition.rig import Role

from ..errors import NotEnoughData
from ..exchange import Excerpt, FunctionAxis, FunctionType, UniversalFunction, export_scan
from ..frequency_response.noise_response import NoiseAnalysis
from ..frequency_response.results import FrequencyResponseRequest
from ..kinds import NOISE_FAMILY, family_of
from ..recordings.facts import require_checked
from ..signals import Complexes, Quantity, Reals, hop_samples, magnitude_bounds, phase_half_width
from ..spectra import DensitySums
from .campaign_results import analyse

_SAME = 0.03
"""Relative frequency difference up to which resonances at two points count as the same."""


@dataclass(frozen=True, eq=False)
class ScanShape:
    """Operating deflection shape: the transmission at all points of a scan at one frequency."""

    frequency_hz: float
    values: Complexes
    """Transmission in the requested quantities, shape (points,)."""
    half_width: Reals
    """Relative half width of the bounds of the magnitude, shape (points,)."""

    @property
    def magnitude_bounds(self) -> tuple[Reals, Reals]:
        """Lower and upper bounds of the magnitude, each of shape (points,)."""
        return magnitude_bounds(np.abs(self.values), self.half_width)

    @property
    def phase_deg(self) -> Reals:
        """Phase against the base [degree], -180 to 180, shape (points,)."""
        return np.rad2deg(np.angle(self.values))

    @property
    def phase_half_width_deg(self) -> Reals:
        """Half width of the phase's bounds [degree], shape (points,)."""
        return np.rad2deg(phase_half_width(self.half_width))


@dataclass(frozen=True, eq=False)
class Scan:
    """Scan: the noise measurements of one plan, one for each point, sorted by node number."""

    analyses: tuple[NoiseAnalysis, ...]

    @property
    def name(self) -> str:
        """Name of the measurement that contains the scan."""
        return self.analyses[0].facts.measurement.name

    @property
    def points(self) -> tuple[ScanPoint, ...]:
        """Measured point of the specimen, one per measurement."""
        return tuple(point for each in self.analyses if (point := each.facts.measurement.point) is not None)

    @property
    def nodes(self) -> tuple[int, ...]:
        """Node number of each point, or the position in the scan if an imported recording has no number."""
        return tuple(each.node or place for place, each in enumerate(self.points, start=1))

    @property
    def shapes(self) -> tuple[ScanShape, ...]:
        """Deflection shape at each resonance that occurs at one or more points."""
        found = sorted(mode.frequency_hz for each in self.analyses for mode in each.response.resonances)
        groups = np.split(np.array(found), np.flatnonzero(np.diff(found) > _SAME * np.array(found[1:])) + 1)
        return tuple(self._shape(float(np.median(each))) for each in groups if each.size)

    def _shape(self, frequency_hz: float) -> ScanShape:
        shown = [each.request.view.apply(each.response.frequency_response) for each in self.analyses]
        lines = [int(np.argmin(np.abs(each.frequency_hz - frequency_hz))) for each in shown]
        values = [each.value[line] for each, line in zip(shown, lines, strict=True)]
        widths = [each.half_width[line] for each, line in zip(shown, lines, strict=True)]
        return ScanShape(frequency_hz, np.array(values), np.array(widths))


def scans_of(analyses: Sequence[NoiseAnalysis]) -> Iterator[Scan]:
    """Yield the scans among noise measurements, given in the order of their start.

    A later attempt at a recording replaces the earlier attempt. Repeated recordings are separate scans.
    """
    latest = {
        (re.sub(r"\.\d+$", "", each.facts.name), point.node): (point, each)
        for each in analyses
        if (point := each.facts.measurement.point) is not None
    }
    scans: dict[tuple[str, int], dict[tuple[int, str], NoiseAnalysis]] = {}
    for point, each in latest.values():
        plan = each.facts.measurement.model_copy(update={"point": None}).model_dump_json()
        node = (point.node or 0, point.name)
        number = next(number for number in count() if node not in scans.get((plan, number), ()))
        scans.setdefault((plan, number), {})[node] = each
    for nodes in scans.values():
        yield Scan(tuple(nodes[node] for node in sorted(nodes)))


_RESOLUTION_HZ = 1.0
"""Line spacing [Hz] of a density from the longest segments (1 s), with Hann window and 50 % overlap."""
_OVERLAP = 0.5
_FEWEST_SAMPLES = 2
_AROUND = frozenset({SegmentLabel.CHECK, SegmentLabel.LEAD_IN, SegmentLabel.RAMP_UP, SegmentLabel.RAMP_DOWN})
"""Labels of parts that are left out; pauses and settling times have no label."""
_UNITS = {Quantity.DISPLACEMENT: "m", Quantity.VELOCITY: "m/s", Quantity.ACCELERATION: "m/s2"}


def spectral_functions(excerpt: Excerpt, request: FrequencyResponseRequest) -> Iterator[UniversalFunction]:
    """Yield the spectral functions of an excerpt.

    These are the densities of all channels during the excitation, from segments of at most one second. For
    noise, the frequency response from base to m0 and its coherence are added; as in `analyse`, they are
    estimated from the whole recording.

    Raises NotEnoughData when the excerpt contains no excitation, or its analysis finds nothing; UnusableData
    when the recording was changed after it was sealed.

    Parameters
    ----------
    excerpt
        Part of an open recording.
    request
        Estimator and quantities of the frequency response.
    """
    require_checked(excerpt.recording)
    played = _played_parts(excerpt)
    if family_of(excerpt.recording.plan) == NOISE_FAMILY:
        analysis: NoiseAnalysis = analyse(excerpt.recording, request)  # type: ignore[assignment]
        yield from _responses(analysis)
    yield from (_density(*played, channel) for channel in excerpt.channels)


def scan_files(paths: Sequence[Path], request: FrequencyResponseRequest, path: Path) -> Iterator[Path]:
    """Write the frequency responses of the scans among recordings to universal files; yield their paths.

    A file contains the nodes as dataset 15, and one dataset 58 per node. With several scans, each file name
    ends with the name of the scan.

    Raises NotEnoughData when no recording was made with noise at a scan point, AnalysisError when a recording
    cannot be analysed, and InvalidRequest when a file exists.

    Parameters
    ----------
    paths
        Recordings in the order of their start.
    request
        Estimator and quantities of the frequency responses.
    path
        The new file, or the pattern for the names of several files.
    """
    found = [analyse(each, request) for each in paths if _is_scanned_noise(each)]
    scans = list(scans_of([each for each in found if isinstance(each, NoiseAnalysis)]))
    if not scans:
        raise NotEnoughData(
            "none of these recordings was made with noise at a scan point; measure a campaign with [[scan]], "
            "or give one recording"
        )
    names = [each.name for each in scans]
    for number, scan in enumerate(scans):
        again = names[:number].count(scan.name)
        ending = f"-{scan.name}{f'-{again + 1}' if again else ''}" if len(scans) > 1 else ""
        nodes = {
            node: (each.x_m, each.y_m, each.z_m) for node, each in zip(scan.nodes, scan.points, strict=True)
        }
        lines_hz = scan.analyses[0].response.frequency_response.frequency_hz
        functions = []
        for node, each in zip(scan.nodes, scan.analyses, strict=True):
            response = _responses(each, node)[0]
            # Clock drift shifts the lines of later points, so interpolate to the lines of the first point.
            values = np.asarray(np.interp(lines_hz, response.frequency_hz, response.values), np.complex128)
            functions.append((each.facts, replace(response, frequency_hz=lines_hz, values=values)))
        yield export_scan(nodes, functions, path.with_name(f"{path.stem}{ending}{path.suffix}"))


def _is_scanned_noise(path: Path) -> bool:
    with open_recording(path) as recording:
        return bool(recording.plan.get("point")) and family_of(recording.plan) == NOISE_FAMILY


def _responses(analysis: NoiseAnalysis, node: int | None = None) -> tuple[UniversalFunction, ...]:
    response, view, point = analysis.response, analysis.request.view, analysis.facts.measurement.point
    found = view.apply(response.frequency_response)
    moved = _axis(Role(analysis.facts.response), analysis.facts.mass, view.response)
    reference = _axis(Role.BASE_ACCELERATION, "base", view.base)
    if point is not None:
        axis = 1 + "xyz".index(point.direction[-1])
        turned = -axis if point.direction.startswith("-") else axis
        moved = replace(moved, node=node or point.node, direction=turned)
        reference = replace(reference, node=0, direction=axis)
    averages = f"{found.n_eff:.4g} averages over {response.used_s:.6g} s of the whole recording"
    note = f"estimator {found.settings.estimator.value}, {averages}"
    # Coherence has no unit, so programs that convert metres to millimetres leave it unchanged.
    bare, bare_reference = (replace(axis, quantity="", unit="NONE") for axis in (moved, reference))
    hz, kinds = found.frequency_hz, FunctionType
    return (
        UniversalFunction(kinds.FREQUENCY_RESPONSE, hz, found.value, moved, reference, note),
        UniversalFunction(kinds.COHERENCE, hz, found.coherence, bare, bare_reference, note),
    )


def _axis(role: Role, body: str, quantity: Quantity) -> FunctionAxis:
    return FunctionAxis(role.value, f"{body} {quantity.value}", quantity.value, _UNITS[quantity])


def _played_parts(excerpt: Excerpt) -> tuple[tuple[Excerpt, ...], int, str]:
    """Return the parts with excitation, the number of samples per segment, and a description.

    Each part is at least one segment long. A recording without labelled parts counts as one part.
    """
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
            f"densities need {max(segment, _FEWEST_SAMPLES) / rate:.3g} s of uninterrupted excitation, "
            f"but {max(chosen_s, 0.0):.3g} s were chosen; choose a longer excerpt"
        )
    stretches = tuple(replace(excerpt, start=start, stop=stop) for _, start, stop in used)
    seconds = sum(each.samples for each in stretches) / rate
    labels = dict.fromkeys(label for label, _, _ in used)
    return stretches, segment, f"over {seconds:.6g} s of {' and '.join(labels)}"


def _density(
    stretches: tuple[Excerpt, ...], segment: int, note: str, channel: ChannelHeader
) -> UniversalFunction:
    hop = hop_samples(segment, _OVERLAP)
    rate = stretches[0].recording.sample_rate_hz
    sums = DensitySums(rate, segment_samples=segment, overlap=_OVERLAP)
    for each in stretches:
        for values in each.channel_blocks(channel.role):
            valid = np.isfinite(values)
            sums.add(np.where(valid, values, 0.0), valid)
        # Insert invalid samples, so that no segment contains samples of two stretches.
        between = hop - each.samples % hop
        sums.add(np.zeros(between), np.zeros(between, dtype=np.bool_))
    found = sums.density()
    return UniversalFunction(
        FunctionType.DENSITY,
        found.frequency_hz,
        found.density,
        FunctionAxis(channel.role, channel.role, channel.quantity, f"({channel.unit})2/Hz"),
        FunctionAxis(),
        f"Hann window, {found.n_eff:.4g} averages {note}",
    )
