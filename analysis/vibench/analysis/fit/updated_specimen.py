"""Fit the parameters of the specimen on the shaker to the recordings of one campaign."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from vibench.acquisition import open_recording
from vibench.sim import Specimen, SpecimenDescription, SpecimenTable
from vibench.sim.background import Observer, ignore_progress

from ..errors import AnalysisError, NotEnoughData
from ..frequency_response.noise_response import NoiseAnalysis, scatter_over_silence, scatters_beyond_noise
from ..kinds import NoiseResult
from ..overlay.driven_rig import described_shaker, fit_shaker
from ..recordings.channels import RecordedChannels
from ..recordings.facts import described_specimen
from ..results.campaign_results import CampaignResults
from ..tables import Tabular, columns, plain, plus_minus
from ..uncertainty.budget import stated_uncertainties
from .collision_numbers import CollisionNumbers, Way, numbers_from_statistics, onset_gap, track_recordings
from .lines import LINEAR, SHOWN, FittedValue, Parameter, with_values
from .specimen_fit import Assumption, SpecimenFit, Suspect, fit_specimen, not_linear

_SURELY = 3.3
"""Deviation [standard deviations] that one correct description in a thousand exceeds."""
_LARGEST_SCATTER = 100.0
"""Largest variance about a linear response, relative to silence; light collisions exceed 1000."""
_WEAKER = "so masses may collide or rub; measure with weaker noise"
_LEAST_RELATIVE_SD = 2e-3
"""Relative error of the fitted table mass due to coil, filters and sample-and-hold output."""


@dataclass(frozen=True)
class TableFit:
    """Fitted and described moving mass of the shaker without the specimen."""

    mass_kg: float
    sd_kg: float
    described_kg: float
    reduced_chi_square: float

    @property
    def z(self) -> float:
        """Difference between fitted and described mass in standard deviations."""
        return float(np.log(self.mass_kg / self.described_kg) * self.mass_kg / self.sd_kg)

    @property
    def suspects(self) -> tuple[Suspect, ...]:
        """Changes that would explain the difference; empty if the described mass fits."""
        if abs(self.z) <= _SURELY:
            return ()
        ratio = self.mass_kg / self.described_kg
        sentence = (
            f"a moving table of {1e3 * self.mass_kg:.4g} g instead of {1e3 * self.described_kg:.4g} "
            f"({100 * (ratio - 1):+.3g} %), or all three masses of the specimen "
            f"changed by {100 * (1 / ratio - 1):+.3g} % (motion determines only ratios of masses)"
        )
        return (Suspect(Assumption.TABLE_MASS, sentence, self.reduced_chi_square, mends=True, behind=0.0),)

    @property
    def sentence(self) -> str:
        """Fitted mass with two standard deviations, and the described mass, in words."""
        mass = plus_minus(1e3 * self.mass_kg, 2e3 * self.sd_kg)
        return f"Fitted mass of the moving table = ({mass}) g; described: {1e3 * self.described_kg:.4g} g."


def fit_table(analysis: NoiseAnalysis, specimen: Specimen) -> TableFit | None:
    """Fit the shaker to weak noise and compare its mass with the described one; None if it is not described.

    The reaction of the specimen's resonances on the base determines the mass. Raises UnusableData when no
    shaker explains the transmission from voltage to base.
    """
    with open_recording(analysis.facts.path) as recording:
        described = described_shaker(recording)
        if described is None:
            return None
        found = fit_shaker(recording, analysis, specimen, described)
    mass = found.shaker.moving_mass_kg
    relative = float(np.hypot(found.relative_sd["moving_mass_kg"], _LEAST_RELATIVE_SD))
    return TableFit(mass, relative * mass, described.moving_mass_kg, found.chi2)


_NOT_FITTED = ("masses_kg", "contact", "hertz_stiffness")


@dataclass(frozen=True, eq=False)
class UpdatedSpecimen(Tabular):
    """A specimen fitted to recordings, with the values that stayed undetermined and the misfits."""

    specimen: Specimen
    values: tuple[FittedValue, ...]
    """Fitted values; empty if the model does not fit."""
    collisions: CollisionNumbers | None
    """Parameters from tracked collisions or from statistics; None if neither is possible."""
    linear: SpecimenFit | None
    """Linear fit to the recording of the weakest noise; None without such a recording."""
    linear_from: str
    """Name of the recording that gives damping and frequencies; empty without such a recording."""
    table: TableFit | None
    not_determined: tuple[str, ...]
    """One sentence for each value that stays as described, with the reason."""
    nominal: SpecimenTable
    """Specimen as described by the bench configuration."""

    @property
    def is_fitted(self) -> bool:
        """Whether at least one parameter was fitted."""
        return bool(self.values) or self.collisions is not None

    @property
    def fits(self) -> bool:
        """Whether no recording contradicts the description and the assumptions of the fit."""
        return not self.suspects

    @property
    def reduced_chi_square(self) -> float:
        """Reduced chi square of the linear fit; NaN without such a fit."""
        return float("nan") if self.linear is None else self.linear.reduced_chi_square

    @property
    def suspects(self) -> tuple[Suspect, ...]:
        """Contradicted assumptions about the linear fit (most likely first), table mass and collisions."""
        linear = () if self.linear is None else self.linear.suspects
        table = () if self.table is None else self.table.suspects
        return (*linear, *table, *_contradictory_suspects(self.collisions))

    def confirm(self, results: CampaignResults) -> "UpdatedSpecimen":
        """Return the fit; omit its values if a simulation with them disagrees with measured noise."""
        overlays = [
            each.overlay for each in results.noise if Path(each.analysis.facts.name).name == self.linear_from
        ]
        if not self.values or all(curve.agrees for each in overlays if each for curve in each.ensemble):
            return self
        described = self.nominal.specimen()
        why = f"a simulation of the fitted specimen disagrees with the recording, {_WEAKER}"
        return replace(
            self,
            specimen=described,
            values=(),
            collisions=None,
            linear=not_linear(described, why),
            table=None,
            not_determined=(),
        )

    @property
    def description(self) -> SpecimenDescription:
        """Fitted specimen in the form of a specimen file; values not fitted are as in the configuration."""
        lower, upper = self.specimen.gaps_m
        fitted = {each.parameter.value for each in self.values}
        if self.collisions is not None:
            fitted |= set(self.collisions.gap_fields)
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
                    if self.linear is not None and self.linear.fits
                    else {}
                ),
            },
        )

    @property
    def sentences(self) -> tuple[str, ...]:
        """Sentences on every value with its interval, on misfits and on undetermined values."""
        return tuple(_sentences(self))

    def to_dict(self) -> dict[str, Any]:
        """Return the results as a dictionary for JSON."""
        values = {each.parameter: each for each in self.values}
        collisions = {key: value for way in Way for key, value in self._collision_results(way).items()}
        linear = columns(
            self,
            "lines=linear.lines reduced_chi_square=linear.reduced_chi_square chi_square_limit=linear.limit "
            "table_mass_kg=table.mass_kg sd_table_mass_kg=table.sd_kg suspects not_told=not_determined",
        )
        document = {
            "fits": self.fits,
            "values": values,
            **collisions,
            "linear_from": self.linear_from or None,
            **linear,
            "lines": linear["lines"] or 0,
            "specimen": self.description.model_dump(mode="json", exclude_none=True),
        }
        return dict(plain(document))

    def _collision_results(self, way: Way) -> dict[str, object]:
        """Return the parameters that ``way`` found from collisions, as a dictionary for JSON."""
        found = self.collisions if self.collisions is not None and self.collisions.way is way else None
        return {
            f"{way}_from": None if found is None else found.recording,
            f"{way}": {
                each.what: columns(each, "value low high bench=described")
                for each in (() if found is None else found.determined)
            },
        }


def _sentences(updated: UpdatedSpecimen) -> Iterator[str]:
    yield from (_in_words(each) for each in updated.values)
    if updated.collisions is not None:
        yield from updated.collisions.sentences
    linear, table = updated.linear, updated.table
    if linear is not None and not linear.lines:
        yield f"No value is fitted to {updated.linear_from}: {linear.suspects[0].sentence}."
    elif linear is not None and not linear.fits:
        yield (
            f"The model does not fit {updated.linear_from}: chi² is {linear.reduced_chi_square:.3g} per "
            f"degree of freedom; a correct model exceeds {linear.limit:.3g} in 1 of 1000 cases. No fitted "
            f"value is given; {culprits_text(linear.suspects)}."
        )
    if table is not None:
        yield table.sentence
        if table.suspects:
            yield f"The table's described mass does not fit: {culprits_text(table.suspects)}."
    contradicted = _contradictory_suspects(updated.collisions)
    if contradicted:
        yield f"Collisions contradict the description: {culprits_text(contradicted)}."
    yield from updated.not_determined


def culprits_text(suspects: Sequence[Suspect]) -> str:
    """Return the possible causes of a misfit as text, including all that the data cannot tell apart."""
    best = suspects[0]
    alike = list(dict.fromkeys(each.sentence for each in suspects if each.may_be_it))
    named = ", or ".join(alike)
    if not best.mends:
        return (
            "no single changed assumption makes the model fit; the best assumption, with chi² = "
            f"{best.reduced_chi_square:.3g}, is {named}"
        )
    choice = "the model fits with any of these, which the data do not distinguish: " if len(alike) > 1 else ""
    return f"{choice}{named}" if choice else f"the model fits with {named}"


def _contradictory_suspects(found: CollisionNumbers | None) -> tuple[Suspect, ...]:
    if found is None or not found.contradictions:
        return ()
    sentence = " and ".join(found.contradictions)
    return (Suspect(Assumption.GAPS, sentence, found.misfit, mends=True, behind=0.0),)


def _in_words(found: FittedValue) -> str:
    name, scale, unit = SHOWN[found.parameter]
    half = 0.5 * (found.high - found.low)
    # Round to the second digit of the half width: the printed lower and upper bounds then differ.
    places = len(plus_minus(scale * found.value, scale * half).partition(" ")[0].partition(".")[2])
    value, low, high, nominal = (
        f"{scale * each:.{places}f}" for each in (found.value, found.low, found.high, found.nominal)
    )
    return f"Fitted {name} = {value} {unit} ({low} to {high} {unit}, 95 %); described: {nominal} {unit}."


def update_model(
    results: CampaignResults,
    also_free: Sequence[Parameter | str] = (),
    observer: Observer = ignore_progress,
) -> UpdatedSpecimen:
    """Return a specimen fitted to recordings, or the assumptions that the recordings contradict.

    Damping and frequencies come from the weakest noise. The gap of each side, m1, c1 and the contact law come
    from a tracked colliding motion, or else from statistics of chaos (minutes of simulation). If both fail,
    the smaller gap comes from the onset of collisions in sweeps or dwells. The table mass comes from the
    transmission from voltage to base. Raises NotEnoughData when nothing can be fitted, because there is no
    noise, no motion that can be tracked, and no onset of collisions.

    Parameters
    ----------
    results
        Results of recordings of one specimen; noise results must be ratios of displacements.
    also_free
        Additional parameters to fit to noise: one mass, and single dampers.
    observer
        Receives the progress.
    """
    of_m0 = tuple(each for each in results.results if each.analysis.facts.mass == "m0")
    results = replace(results, results=of_m0)  # scan points may be on other masses
    if not of_m0:
        raise NotEnoughData(f"{results.name!r} has no result for m0, so no specimen can be fitted")
    described = described_specimen(results.facts[0].bench)
    nominal = described.specimen()
    reasons: list[str] = []
    if len({described_specimen(each.bench).specimen() for each in results.facts}) > 1:
        reasons.append(
            "The recordings describe different specimens; the fit takes them as one specimen, described as "
            f"in {results.facts[0].name}."
        )
    free = (*LINEAR, *(Parameter(each) for each in also_free))
    linear = _linear(results, nominal, free, reasons)
    table = _table(results.noise[0], linear, reasons) if linear is not None and linear.fits else None
    updated = UpdatedSpecimen(
        specimen=nominal if linear is None else linear.specimen,
        values=() if linear is None else linear.values,
        collisions=None,
        linear=linear,
        linear_from="" if linear is None else Path(results.noise[0].analysis.facts.name).name,
        table=table,
        not_determined=(),
        nominal=described,
    )
    if linear is not None and linear.lines and not linear.fits:
        reasons.append("Gaps and contacts stay as described: the linear model does not fit.")
    else:
        updated = _with_gaps(updated, results, reasons, observer)
        if not updated.is_fitted and updated.fits:
            raise NotEnoughData(f"no specimen can be fitted to {results.name!r}: {' '.join(reasons)}")
    return replace(updated, not_determined=tuple(reasons))


def _linear(
    results: CampaignResults, nominal: Specimen, free: Sequence[Parameter], reasons: list[str]
) -> SpecimenFit | None:
    if not results.noise:
        reasons.append("Damping and frequencies stay as described: no noise was recorded.")
        return None
    facts, weakest = results.noise[0].analysis.facts, results.noise[0].analysis.response
    with open_recording(facts.path) as recording:
        channels = RecordedChannels(recording, response=facts.response)
        scatter = scatter_over_silence(channels, results.noise[0].analysis.excitation, weakest)
    if scatter > _LARGEST_SCATTER:
        why = f"the linear response leaves {np.sqrt(scatter):.2g} times as much scatter of m0 as in silence"
        return not_linear(nominal, f"{why}, {_WEAKER}")
    is_nonlinear = None if weakest.periodic is None else scatters_beyond_noise(weakest.periodic)
    try:
        return fit_specimen(
            weakest.frequency_response,
            nominal,
            free,
            scale_sd=stated_uncertainties(facts.bench, facts.response).scale_sd,
            is_nonlinear=is_nonlinear,
        )
    except NotEnoughData as error:
        reasons.append(f"Damping and frequencies stay as described: {error}.")
        return None


def _table(weakest: NoiseResult, linear: SpecimenFit, reasons: list[str]) -> TableFit | None:
    try:
        return fit_table(weakest.analysis, linear.specimen)
    except AnalysisError as error:
        reasons.append(f"The mass of the table stays as described: {error}.")
        return None


def _with_gaps(
    updated: UpdatedSpecimen, results: CampaignResults, reasons: list[str], observer: Observer
) -> UpdatedSpecimen:
    """Add the gaps from tracking, else from statistics, else the smaller gap from the onset of collisions."""
    found, why = track_recordings(results, updated.specimen)
    if found is None:
        found, why_not = numbers_from_statistics(results, updated.specimen, updated.linear, observer)
        both = f"{why}; by statistics: {why_not}" if why_not else why
        reasons.append(
            f"Both gaps, m1, c1 and the contact law are not determined: {both}."
            if found is None
            else f"No motion with collisions could be tracked: {why}."
        )
    if found is not None:
        updated = replace(updated, collisions=found, specimen=found.on(updated.specimen))
        if found.gap_fields:
            return updated
    sweeps, dwells = [each.analysis for each in results.sweeps], [each.analysis for each in results.dwells]
    try:
        gap = onset_gap(sweeps, dwells, updated.specimen, updated.linear)
    except NotEnoughData as error:
        reasons.append(f"The gap stays as described: {error}.")
        return updated
    return replace(
        updated,
        specimen=with_values(updated.specimen, {Parameter.GAP: gap.value}),
        values=(*updated.values, gap),
    )
