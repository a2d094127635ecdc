"""Distribution of a campaign's time over its measurements, by the time each needs for its targets."""

from dataclasses import dataclass
from math import sqrt

from pydantic import ValidationError

from vibench.acquisition import ConfigurationError
from vibench.acquisition.plan import Campaign, Excitation, Measurement, measured_s
from vibench.acquisition.rig import Rig
from vibench.sim import fault_in_words

from .expected import recorded_s, time_to_wishes_s


@dataclass(frozen=True)
class TimeShare:
    """Recording time of one measurement."""

    name: str
    planned_s: float
    """Recording time in the campaign [s]."""
    needed_s: float | None
    """Predicted recording time until the targets are met [s]; None without targets or a prediction."""
    allotted_s: float
    """Longest recording time after the distribution [s]."""

    @property
    def sentence(self) -> str:
        """Recording time in words."""
        needed = "as planned" if self.needed_s is None else f"needs about {self.needed_s:.3g} s"
        return f"{self.name}: at most {self.allotted_s:.4g} s of recording ({needed})"


def within(campaign: Campaign, rig: Rig, available_s: float) -> tuple[Campaign, tuple[TimeShare, ...]]:
    """Return the campaign with recording times that fill ``available_s``, and the share of each measurement.

    A measurement needs the time after which `expected_uncertainty` meets its `until`. All these times are
    lengthened by one factor. Sweeps, and measurements without a prediction, keep their times.

    Raises ConfigurationError when no measurement has targets with a prediction, or the time is too short for
    all targets.
    """
    needs = {each.name: time_to_wishes_s(each, rig) for each in campaign.measurements}
    mine = [each for each in campaign.measurements if needs[each.name] is not None]
    if not mine:
        raise ConfigurationError(
            f"{campaign.name} has no measurement with until whose time can be predicted, so no time can be "
            "distributed. Nothing was played; add until to a measurement, or leave --within out"
        )
    places = campaign.places
    variable_s = sum(places * each.repeats * _cost(each) * recorded_s(each) for each in mine)
    needed_s = sum(places * each.repeats * _cost(each) * (needs[each.name] or 0.0) for each in mine)
    fixed_s = campaign.duration_s - variable_s
    if available_s < fixed_s + needed_s:
        left_s = available_s - fixed_s
        most = (
            f"in this time bounds would be {sqrt(needed_s / left_s):.2g} times as wide as wished"
            if left_s > 0
            else "ramps, settling and what has no wish take longer"
        )
        raise ConfigurationError(
            f"{available_s:g} s are too short for {campaign.name}, whose wishes need about "
            f"{fixed_s + needed_s:.0f} s: {most}. Nothing was played; give more time or wider bounds"
        )
    factor = (available_s - fixed_s) / needed_s
    changed = [
        each if (need := needs[each.name]) is None else _lasting(each, factor * need)
        for each in campaign.measurements
    ]
    shares = tuple(
        TimeShare(old.name, recorded_s(old), needs[old.name], recorded_s(new))
        for old, new in zip(campaign.measurements, changed, strict=True)
    )
    return campaign.model_copy(update={"measurements": tuple(changed)}), shares


def _cost(measurement: Measurement) -> float:
    """Return the time on the rig per recorded time; each realisation of noise adds ramps and a wait."""
    has_many = measurement.excitation.stretches > 1
    return measured_s(measurement) / recorded_s(measurement) if has_many else 1.0


def _lasting(measurement: Measurement, time_s: float) -> Measurement:
    """Return the measurement with another recording time, in whole realisations."""
    excitation: Excitation = measurement.excitation
    share = time_s / recorded_s(measurement)
    longer = {
        name: max(1, int(share * value + 1e-9)) if isinstance(value, int) else share * value
        for name in ("duration_s", "record_s", "realisations")
        if (value := getattr(excitation, name, None)) is not None
    }
    document = measurement.model_dump() | {"excitation": excitation.model_dump() | longer}
    try:
        return Measurement.model_validate(document)
    except ValidationError as error:
        raise ConfigurationError(
            f"{measurement.name} would be recorded for {time_s:.4g} s, which its kind does not allow "
            f"({fault_in_words(error.errors()[0])}). Nothing was played; give less time or wider bounds"
        ) from error
