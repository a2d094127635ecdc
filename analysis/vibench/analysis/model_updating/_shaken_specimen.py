"""The specimen that is really on the shaker, from the recordings of one campaign."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vibench.sim import Specimen

from ..errors import AnalysisError, NotEnoughData
from ..recordings import specimen_of
from ..results import CampaignResults
from ._dwell_bracket import bracketed_gap
from ._gap_fit import fit_gap
from ._specimen_fit import FittedValue, SpecimenFit, fit_specimen
from ._specimen_parameters import Parameter, with_values

_SHOWN = {
    Parameter.DAMPING_TIME: ("c / k", 1e6, "µs"),
    Parameter.F0: ("f0", 1.0, "Hz"),
    Parameter.F1: ("f1", 1.0, "Hz"),
    Parameter.F2: ("f2", 1.0, "Hz"),
    Parameter.GAP: ("gap", 1e6, "µm"),
}
_LEFT_OVER = 2.0
"""A reduced chi square above which the model is said to leave more than the scatter explains."""


@dataclass(frozen=True, eq=False)
class ShakenSpecimen:
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
                    "value": each.value,
                    "low": each.low,
                    "high": each.high,
                    "sd": each.sd if np.isfinite(each.sd) else None,
                    "bench": each.nominal,
                }
                for each in self.values
            },
            "linear_from": self.linear_from or None,
            "lines": self.lines,
            "reduced_chi_square": self.reduced_chi_square if np.isfinite(self.reduced_chi_square) else None,
            "not_told": list(self.not_told),
        }


def _said(found: FittedValue) -> str:
    name, scale, unit = _SHOWN[found.parameter]
    # Two digits of the interval, so that it is an interval on paper too.
    digits = max(0, 1 - math.floor(math.log10(scale * (found.high - found.low))))
    value, low, high, nominal = (
        f"{scale * each:.{digits}f}" for each in (found.value, found.low, found.high, found.nominal)
    )
    return f"Fitted {name} = {value} {unit} ({low} to {high} {unit}, 95 %); the bench says {nominal} {unit}."


def shaken_specimen(results: CampaignResults) -> ShakenSpecimen:
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
    nominal = specimen_of(results.facts[0].bench)
    not_told: list[str] = []
    linear, linear_from = _linear(results, nominal, not_told)
    model = nominal if linear is None else linear.specimen
    values = () if linear is None else linear.values
    gap = _gap(results, model, linear, not_told)
    if gap is not None:
        model, values = with_values(model, {Parameter.GAP: gap.value}), (*values, gap)
    if not values:
        raise NotEnoughData(f"no specimen can be fitted to {results.name!r}: {' '.join(not_told)}")
    return ShakenSpecimen(
        specimen=model,
        values=values,
        linear_from=linear_from,
        reduced_chi_square=float("nan") if linear is None else linear.reduced_chi_square,
        lines=0 if linear is None else linear.lines,
        not_told=tuple(not_told),
    )


def _linear(
    results: CampaignResults, nominal: Specimen, not_told: list[str]
) -> tuple[SpecimenFit | None, str]:
    if not results.noise:
        not_told.append("Damping and frequencies stay as the bench says: no noise was recorded.")
        return None, ""
    weakest = results.noise[0].analysis
    try:
        return fit_specimen(weakest.response.transmission, nominal), Path(weakest.facts.name).name
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
