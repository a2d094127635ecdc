"""A quantity with its uncertainty contributions, combined as in the GUM."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from math import hypot
from typing import Any, ClassVar

import numpy as np

from ..recordings.channels import BASE, described_sensor
from ..tables import Tabular, plus_minus

COVERAGE = 2.0
"""Coverage factor of expanded uncertainties, for a coverage of about 95 %."""
WIDENING = 1.4
"""Factor on the scatter of a recording that ended because its scatter was small; see `Budget.widen`."""


RESULT_PATTERNS: Mapping[str, str] = {
    "resonance_hz": r"^resonance at .*, frequency$",
    "transmissibility": r"^transmissibility at ",
    "response_i": r"\bResponse I\b",
    "response_ii": r"\bResponse II\b",
}
"""Patterns for the names of quantities that can end a recording, keyed by result; see `Until` of plans."""


class Cause(StrEnum):
    """Cause of uncertainty."""

    VIBROMETER = "vibrometer calibration"
    ACCELEROMETER = "accelerometer calibration"
    DISPLACEMENT_PROBE = "displacement probe calibration"
    FORCE_CELL = "force cell calibration"
    CONVERTER = "converter"
    ALIGNMENT = "alignment"
    CLOCK = "clock"
    NOISE = "noise"
    CHANCE = "chance"
    """Chance: the record is one random sample of an irregular motion or of the response to noise."""


@dataclass(frozen=True)
class Contribution:
    """Contribution of one cause to an uncertainty."""

    cause: Cause
    relative: float | None
    """Relative standard uncertainty; None if not stated."""
    source: str
    """Source of the uncertainty's value, or the information that is missing."""

    def __post_init__(self) -> None:
        if self.relative is not None and not 0.0 <= self.relative < np.inf:
            raise ValueError(
                f"{self.source}: a standard uncertainty of {self.relative:g} was given; it must be finite "
                "and not negative: give a root mean square, or None"
            )


def from_scatter(cause: Cause, sd: float, value: float, source: str) -> Contribution:
    """Return the contribution of a standard deviation; not stated if its ratio to the value is not finite."""
    with np.errstate(all="ignore"):
        relative = float(np.divide(sd, abs(value)))
    return Contribution(cause, relative if np.isfinite(relative) else None, source)


@dataclass(frozen=True)
class Budget(Tabular):
    """Uncertainty budget of one quantity of one measurement."""

    OWN_UNITS: ClassVar = {"value": "{0.unit}"}
    DOCUMENT: ClassVar = (
        "quantity value unit standard expanded coverage_factor contributions=parts not_stated"
    )
    coverage_factor: ClassVar = COVERAGE

    quantity: str
    value: float
    unit: str
    contributions: tuple[Contribution, ...]

    @property
    def standard(self) -> float:
        """Combined standard uncertainty of the stated contributions (JCGM 100:2008, eq. 10) [unit]."""
        stated = [each.relative for each in self.contributions if each.relative is not None]
        return float(abs(self.value)) * hypot(*stated)

    @property
    def expanded(self) -> float:
        """Expanded uncertainty: twice the standard uncertainty [unit]."""
        return COVERAGE * self.standard

    @property
    def not_stated(self) -> tuple[Cause, ...]:
        """Relevant causes without a stated uncertainty."""
        return tuple(dict.fromkeys(each.cause for each in self.contributions if each.relative is None))

    @property
    def text(self) -> str:
        """The value with its expanded uncertainty and unit."""
        number = plus_minus(self.value, self.expanded)
        return f"({number}) {self.unit}" if self.unit and "±" in number else f"{number} {self.unit}".strip()

    def share(self, cause: Cause) -> float | None:
        """Return the relative standard uncertainty of one cause: 0 if irrelevant, None if not stated."""
        mine = [each.relative for each in self.contributions if each.cause is cause]
        stated = [each for each in mine if each is not None]
        return None if len(stated) < len(mine) else hypot(*stated)

    def widen(self) -> "Budget":
        """Return the widened budget of a recording that ended when its scatter was small enough.

        Such a recording often ends because its scatter is underestimated. The factor gives 95 % coverage for
        any target: `benchmarks/until_coverage.py --rule`. The factor applies to Gaussian records of ten parts
        that are checked up to nine times, at intervals that grow by the square root of two.
        """
        parts = tuple(
            replace(each, relative=WIDENING * each.relative, source=f"{each.source}, which ended the record")
            if each.cause in (Cause.NOISE, Cause.CHANCE) and each.relative is not None
            else each
            for each in self.contributions
        )
        return replace(self, contributions=parts)

    @property
    def sentence(self) -> str:
        """Return a sentence with the expanded uncertainty and the contributions, the largest first."""
        causes = dict.fromkeys(each.cause for each in self.contributions)
        parts = sorted(((size, cause.value) for cause in causes if (size := self.share(cause))), reverse=True)
        each = ", ".join(f"{what} {100 * relative:.2g} %" for relative, what in parts)
        remarks = [f"k = {COVERAGE:g}; standard uncertainties: {each}"] if each else []
        remarks += [f"not stated: {', '.join(self.not_stated)}"] if self.not_stated else []
        return f"{self.quantity} {self.text} ({'; '.join(remarks) or 'no uncertainty'})"

    @property
    def parts(self) -> list[dict[str, object]]:
        """Cause, standard uncertainty [unit] and source of each contribution."""
        return [
            {
                "cause": each.cause,
                "standard": None if each.relative is None else each.relative * abs(self.value),
                "source": each.source,
            }
            for each in self.contributions
        ]


_SENSORS = {
    "velocity": Cause.VIBROMETER,
    "acceleration": Cause.ACCELEROMETER,
    "displacement": Cause.DISPLACEMENT_PROBE,
    "force": Cause.FORCE_CELL,
}


@dataclass(frozen=True)
class ChannelSd:
    """Relative standard uncertainties of the channels from a bench configuration."""

    response: tuple[Contribution, ...]
    """Contributions of the channel that measures m0."""
    base: tuple[Contribution, ...]
    """Contributions of the channel of the base."""
    clock: Contribution
    """Contribution of the clock to every frequency."""

    @property
    def scale_sd(self) -> float:
        """Stated relative standard deviation of the ratio response / base; 0 if none is stated."""
        stated = [each.relative for each in (*self.response, *self.base) if each.relative is not None]
        return float(np.sqrt(np.sum(np.square(stated))))

    def timing(self, power: int) -> tuple[Contribution, ...]:
        """Return the clock's contribution to a quantity proportional to a power of frequency."""
        relative = None if self.clock.relative is None else abs(power) * self.clock.relative
        return (Contribution(Cause.CLOCK, relative, self.clock.source),)


def stated_uncertainties(bench: Mapping[str, Any], response: str) -> ChannelSd:
    """Return the stated uncertainties of a recording's bench; ``response`` is the channel of m0.

    Calibration errors are normal with their coverage factor; clock errors are uniform within bounds.
    Misalignment scales by the cosine of a uniform angle; the rms value is used (JCGM 100:2008, F.2.4.5).
    """
    inputs = {each.get("role"): each for each in (bench.get("daq") or {}).get("channels") or ()}
    of_response, of_base = (tuple(_channel(bench, role, inputs.get(role, {}))) for role in (response, BASE))
    return ChannelSd(of_response, of_base, _clock(bench))


def _channel(bench: Mapping[str, Any], role: str, mine: Mapping[str, Any]) -> Iterator[Contribution]:
    facts, cause = described_sensor(bench, role), _SENSORS[role.partition("_")[2]]
    sensor = cause.value.removesuffix(" calibration")
    yield _calibration(cause, facts, sensor)
    yield _calibration(Cause.CONVERTER, mine, f"input of {role}")
    angle = facts.get("alignment_deg")
    if angle is None:
        yield Contribution(Cause.ALIGNMENT, None, f"{sensor}: alignment_deg is not stated")
    else:
        # Rms of angle^2 / 2 for a uniformly distributed angle.
        relative = np.radians(float(angle["value"])) ** 2 / np.sqrt(20.0)
        yield Contribution(Cause.ALIGNMENT, float(relative), f"{sensor}: {angle['source']}")


def _calibration(cause: Cause, facts: Mapping[str, Any], what: str) -> Contribution:
    found, dated = facts.get("uncertainty"), facts.get("calibrated")
    when = f"calibrated {dated}" if dated else "no date of calibration"
    if found is None:
        return Contribution(cause, None, f"{what}: uncertainty is not stated ({when})")
    relative = float(found["relative"]) / float(found.get("coverage_factor", 2.0))
    return Contribution(cause, relative, f"{what}: {found['source']} ({when})")


def _clock(bench: Mapping[str, Any]) -> Contribution:
    found = (bench.get("daq") or {}).get("clock_ppm")
    if found is None:
        return Contribution(Cause.CLOCK, None, "daq: clock_ppm is not stated")
    return Contribution(Cause.CLOCK, float(found["value"]) * 1e-6 / np.sqrt(3.0), f"daq: {found['source']}")
