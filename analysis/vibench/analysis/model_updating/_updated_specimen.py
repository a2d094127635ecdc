"""The specimen that is really on the shaker, from the recordings of one campaign.

The gap between two dwells: one whose relative motion does not fill it yet, and one whose motion does.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vibench.sim import Specimen, SpecimenDescription, SpecimenTable, base_transmissibility

from ..errors import AnalysisError, NotEnoughData
from ..recordings import described_specimen
from ..results import CampaignResults
from ..sine import DwellAnalysis
from ..tables import named, plain
from ._gap_fit import fit_gap
from ._specimen_fit import FittedValue, Parameter, SpecimenFit, fit_specimen, with_values

CALM, COLLIDING = 1.01, 1.05
"""Response I over Response II: 1 for a sine; between the two nothing is said."""
_RELATIVE = 3
"""Column of p in `base_transmissibility`."""
_SAME_HZ = 0.5
"""Dwells whose frequencies differ by less were played at one frequency."""


@dataclass(frozen=True)
class Bracket:
    """Bounds of the gap from the dwells at one frequency."""

    frequency_hz: float
    low_m: float
    """Largest relative motion without collisions."""
    high_m: float
    """Smallest relative motion, had there been no stops, that collided."""


def bracketed_gap(dwells: Sequence[DwellAnalysis], linear: Specimen) -> FittedValue:
    """Give the gap from the narrowest bracket; its value is the geometric mean of the bounds.

    Raises NotEnoughData when no frequency has a dwell on either side of the onset.
    """
    found = list(brackets(dwells, linear))
    if not found:
        raise NotEnoughData(
            "no frequency has both a dwell that does not collide and one that does, so the gap cannot be "
            "told from dwells; add one below and one above the onset"
        )
    best = min(found, key=lambda each: each.high_m / each.low_m)
    return FittedValue(
        parameter=Parameter.GAP,
        value=float(np.sqrt(best.low_m * best.high_m)),
        low=best.low_m,
        high=best.high_m,
        sd=float("nan"),
        nominal=min(linear.gaps_m),
    )


def brackets(dwells: Sequence[DwellAnalysis], linear: Specimen) -> Iterator[Bracket]:
    """Give a bracket for every frequency with dwells on both sides.

    Collisions push the base off its course, so the motion that a colliding dwell would have without them is
    taken from the generator's setting and from what a volt did to the base in the largest calm dwell.
    """
    rest = list(dwells)
    while rest:
        at_hz = rest[0].response.drive.frequency_hz
        here = [each for each in rest if abs(each.response.drive.frequency_hz - at_hz) < _SAME_HZ]
        rest = [each for each in rest if each not in here]
        calm = [each for each in here if _peakedness(each) <= CALM]
        colliding = [each for each in here if _peakedness(each) >= COLLIDING]
        if not calm or not colliding:
            continue
        loudest = max(calm, key=lambda each: each.excitation.amplitude_vpp)
        per_m = abs(base_transmissibility(linear, [at_hz])[0, _RELATIVE])
        low_m = float(per_m * loudest.response.drive.amplitude_m)
        volts = min(each.excitation.amplitude_vpp for each in colliding)
        high_m = low_m * volts / loudest.excitation.amplitude_vpp
        if high_m > low_m:
            yield Bracket(at_hz, low_m, high_m)


def _peakedness(dwell: DwellAnalysis) -> float:
    found = dwell.response
    return (found.response_i - found.noise_bias_i) / found.response_ii


_SHOWN = {
    Parameter.DAMPING_TIME: ("c / k", 1e6, "µs"),
    Parameter.F0: ("f0", 1.0, "Hz"),
    Parameter.F1: ("f1", 1.0, "Hz"),
    Parameter.F2: ("f2", 1.0, "Hz"),
    Parameter.GAP: ("gap", 1e6, "µm"),
}
_NOT_FITTED = ("masses_kg", "contact", "hertz_stiffness")
_LEFT_OVER = 2.0
"""A reduced chi square above which the model is said to leave more than the scatter explains."""


@dataclass(frozen=True, eq=False)
class UpdatedSpecimen:
    """A specimen fitted to recordings, with what could not be told."""

    specimen: Specimen
    values: tuple[FittedValue, ...]
    linear_from: str
    """Recording whose transmission told damping and frequencies; empty if none did."""
    reduced_chi_square: float
    """Of that fit; NaN if there was none."""
    lines: int
    not_told: tuple[str, ...]
    """A sentence for everything that stays as the bench says, and why."""
    nominal: SpecimenTable
    """As the bench describes it."""

    @property
    def description(self) -> SpecimenDescription:
        """The fitted specimen as a file has it; what was not fitted is the bench's."""
        lower, upper = self.specimen.gaps_m
        fitted = {each.parameter.value for each in self.values}
        return SpecimenDescription(
            name=f"{self.nominal.name}_fitted",
            about=f"{self.nominal.name}, fitted to recordings: {', '.join(sorted(fitted))}",
            masses_kg=self.specimen.masses,
            stiffnesses_n_per_m=self.specimen.stiffnesses,
            dampings_ns_per_m=self.specimen.dampings,
            gap_m=upper if lower == upper else (lower, upper),
            contact=self.nominal.contact,
            hertz_stiffness=self.nominal.hertz_stiffness,
            sources={
                **{key: source for key, source in self.nominal.sources.items() if key in _NOT_FITTED},
                **(
                    {"stiffnesses_n_per_m": self.linear_from, "dampings_ns_per_m": self.linear_from}
                    if self.linear_from
                    else {}
                ),
            },
        )

    @property
    def sentences(self) -> tuple[str, ...]:
        """Say every value with its interval, and what is to be known of it."""
        said = [_said(each) for each in self.values]
        if self.reduced_chi_square > _LEFT_OVER:
            said.append(
                f"The linear model leaves {self.reduced_chi_square:.3g} times the squared residual that the "
                f"scatter of {self.linear_from} explains; the intervals are widened by that."
            )
        return (*said, *self.not_told)

    def to_dict(self) -> dict[str, object]:
        """Plain values for JSON."""
        return {
            "values": {
                each.parameter.value: {
                    **named(each, "value", "low", "high"),
                    "sd": plain(each.sd),
                    "bench": each.nominal,
                }
                for each in self.values
            },
            "linear_from": self.linear_from or None,
            "lines": self.lines,
            "reduced_chi_square": plain(self.reduced_chi_square),
            "not_told": list(self.not_told),
            "specimen": self.description.model_dump(mode="json", exclude_none=True),
        }


def _said(found: FittedValue) -> str:
    name, scale, unit = _SHOWN[found.parameter]
    # Two digits of the interval, so that it is an interval on paper too.
    digits = max(0, 1 - math.floor(math.log10(scale * (found.high - found.low))))
    value, low, high, nominal = (
        f"{scale * each:.{digits}f}" for each in (found.value, found.low, found.high, found.nominal)
    )
    return f"Fitted {name} = {value} {unit} ({low} to {high} {unit}, 95 %); the bench says {nominal} {unit}."


def update_model(results: CampaignResults) -> UpdatedSpecimen:
    """Fit damping and frequencies to the weakest noise, and the gap to where sweeps or dwells collide.

    Parameters
    ----------
    results
        Of recordings of one specimen; their simulation is not needed. Noise in displacement over
        displacement.

    Raises
    ------
    NotEnoughData
        When neither could be fitted: no noise, and no sweep or pair of dwells that tells the gap.

    """
    if not results.results:
        raise NotEnoughData(f"{results.name!r} has no result to which a specimen could be fitted")
    described = described_specimen(results.facts[0].bench)
    nominal = described.specimen()
    not_told: list[str] = []
    linear, linear_from = _linear(results, nominal, not_told)
    model = nominal if linear is None else linear.specimen
    values = () if linear is None else linear.values
    gap = _gap(results, model, linear, not_told)
    if gap is not None:
        model, values = with_values(model, {Parameter.GAP: gap.value}), (*values, gap)
    if not values:
        raise NotEnoughData(f"no specimen can be fitted to {results.name!r}: {' '.join(not_told)}")
    return UpdatedSpecimen(
        specimen=model,
        values=values,
        linear_from=linear_from,
        reduced_chi_square=float("nan") if linear is None else linear.reduced_chi_square,
        lines=0 if linear is None else linear.lines,
        not_told=tuple(not_told),
        nominal=described,
    )


def _linear(
    results: CampaignResults, nominal: Specimen, not_told: list[str]
) -> tuple[SpecimenFit | None, str]:
    if not results.noise:
        not_told.append("Damping and frequencies stay as the bench says: no noise was recorded.")
        return None, ""
    weakest = results.noise[0].analysis
    try:
        return fit_specimen(weakest.response.frequency_response, nominal), Path(weakest.facts.name).name
    except AnalysisError as error:
        not_told.append(f"Damping and frequencies stay as the bench says: {error}.")
        return None, ""


def _gap(
    results: CampaignResults, model: Specimen, linear: SpecimenFit | None, not_told: list[str]
) -> FittedValue | None:
    """Give the narrower of what sweeps and dwells tell."""
    sweeps, dwells = [each.analysis for each in results.sweeps], [each.analysis for each in results.dwells]
    ways: tuple[Callable[[], FittedValue], ...] = (
        lambda: fit_gap(sweeps, model, linear),
        lambda: bracketed_gap(dwells, model),
    )
    found: list[FittedValue] = []
    why: list[str] = []
    for tell in ways:
        try:
            found.append(tell())
        except NotEnoughData as error:
            why.append(str(error))
    if not found:
        not_told.append(f"The gap stays as the bench says: {'; '.join(why)}.")
        return None
    return min(found, key=lambda each: each.high / each.low)
