"""Scans: transmissions at several points of the specimen, and their deflection shapes at the resonances."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np

from vibench.acquisition.plan import ScanPoint

from ..signals import Complexes, Reals, magnitude_bounds, phase_half_width
from .noise_response import NoiseAnalysis

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
