"""Uncertainty budgets: quantities and their contributions for each measurement, combined as in the GUM."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from math import hypot
from typing import Any, ClassVar

import numpy as np

from ..chaos.verdict import MotionKind
from ..frequency_response.modal_fit import Resonance
from ..frequency_response.noise_response import NoiseAnalysis, NoiseResponse
from ..overlay.overlay import RESPONSE_I, RESPONSE_II, AbstractOverlay, DwellOverlay
from ..recordings.channels import BASE, described_sensor
from ..recordings.facts import RecordingFacts
from ..signals import Flags, Reals
from ..sine.dwell import DwellResponse
from ..sine.dwell_analysis import BURST, DwellAnalysis
from ..sine.stepped_response import SteppedResponse, SteppedSineAnalysis
from ..sine.sweep import SweepResponse
from ..sine.sweep_analysis import SweepAnalysis
from ..tables import Tabular, with_unit

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
    """Return the contribution of a standard deviation; it is not stated if sd / value is not finite."""
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
        return with_unit(self.value, self.expanded, self.unit)

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
        # For a uniformly distributed angle, this is the rms of angle^2 / 2.
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


_BLOCKS, _FEWEST_BLOCKS = 50, 10
"""Usual and minimum number of parts of a window; the parts' maxima give the scatter of the largest value."""
_ALIKE = 1e-12
"""Largest relative difference of maxima that counts as rounding error."""
_SHAPE_VARIANCE = 0.5633
"""n times the variance of the shape k estimated from n maxima (Hosking, Wallis and Wood 1985, for k = 0)."""
_FEWEST_DRAWS = 5
_NO_DRAWS = Contribution(Cause.CHANCE, None, "there are no draws of the twin")
"""Unknown random error of a maximum, or of a 0.1 s sweep interval; only draws could determine this error."""
_ENDS = 2
"""Number of intervals at each end of a sweep where a largest value depends on where the intervals begin."""
_PEAKED = 1.05
"""Ratio of Response I to Response II above which the motion in a step is not a sine."""
_FEWEST_PERIODS = 20.0
"""Minimum number of drive periods in a part, so that its maximum is the largest of many peaks."""


def noise_budgets(analysis: NoiseAnalysis, _: AbstractOverlay[Any] | None) -> tuple[Budget, ...]:
    """Return budgets for frequency, damping ratio and transmissibility of every resonance."""
    stated = stated_uncertainties(analysis.facts.bench, analysis.facts.response)
    found = analysis.response
    chance = _chance_share(found)
    peak = ("apparent mass", "kg") if analysis.view.is_force else ("transmissibility", "")
    return tuple(each for one in found.resonances for each in _of_resonance(one, stated, chance, peak))


def _of_resonance(
    found: Resonance, stated: ChannelSd, chance: float, peak: tuple[str, str]
) -> Iterator[Budget]:
    where = f"{found.frequency_hz:.0f} Hz"

    def scatter(sd: float, value: float) -> tuple[Contribution, ...]:
        parts = ((Cause.NOISE, 1.0 - chance), (Cause.CHANCE, chance))
        return tuple(
            from_scatter(cause, sd * float(np.sqrt(part)), value, "scatter of the lines")
            for cause, part in parts
            if part > 0.0
        )

    yield Budget(
        f"resonance at {where}, frequency",
        found.frequency_hz,
        "Hz",
        (*stated.timing(1), *scatter(found.sd_frequency_hz, found.frequency_hz)),
    )
    yield Budget(
        f"resonance at {where}, damping ratio",
        100 * found.damping_ratio,
        "%",
        scatter(found.sd_damping_ratio, found.damping_ratio),
    )
    yield Budget(
        f"{peak[0]} at {where}",
        found.peak_magnitude,
        peak[1],
        (*_ratio(stated), *scatter(found.sd_peak_magnitude, found.peak_magnitude)),
    )


def _chance_share(found: NoiseResponse) -> float:
    """Return the fraction of the lines' variance that exceeds the scatter of periods; 0 if unknown."""
    if found.periodic is None or found.periodic.distortion_variance is None:
        return 0.0
    more = float(np.median(found.periodic.distortion_variance))
    least = float(np.median(found.periodic.noise_variance))
    return more / (more + least) if more > 0.0 else 0.0


def dwell_budgets(analysis: DwellAnalysis, overlay: DwellOverlay | None) -> tuple[Budget, ...]:
    """Return budgets for the base amplitude and Responses I and II of a dwell."""
    found = analysis.response
    stated = stated_uncertainties(analysis.facts.bench, analysis.facts.response)
    is_steady = analysis.motion.verdict.kind is MotionKind.PERIODIC
    scatter = Cause.NOISE if is_steady else Cause.CHANCE
    drive = found.drive
    of_base = from_scatter(scatter, drive.sd_amplitude_m, drive.amplitude_m, "parts of the window")
    is_chance = not (is_steady or np.isnan(found.slow_change))
    one_draw = [_scatter(overlay, RESPONSE_I, 0) or of_one_draw(found)] if is_chance else []
    noise = from_scatter(Cause.NOISE, found.noise_error_i, found.response_i, found.noise_source)
    return (
        _amplitude(drive.amplitude_m, stated, of_base),
        Budget(
            RESPONSE_I,
            found.response_i,
            "",
            (
                *_ratio(stated),
                noise,
                *_of_change(found.slow_change),
                *((_of_base(drive.sd_amplitude_m, drive.amplitude_m),) if is_steady else ()),
                *one_draw,
            ),
        ),
        Budget(
            RESPONSE_II,
            found.response_ii,
            "",
            (
                *_ratio(stated),
                from_scatter(scatter, found.sd_response_ii, found.response_ii, "tenths of the window"),
            ),
        ),
    )


def _ratio(stated: ChannelSd) -> tuple[Contribution, ...]:
    """Return the contributions to a displacement ratio, measured as velocity / acceleration * frequency."""
    return (*stated.response, *stated.base, *stated.timing(1))


def _amplitude(value_m: float, stated: ChannelSd, scatter: Contribution, where: str = "") -> Budget:
    return Budget(
        f"base amplitude A0{where}", 1e6 * value_m, "µm", (*stated.base, *stated.timing(2), scatter)
    )


def _of_base(sd_m: float, amplitude_m: float) -> Contribution:
    """Return the contribution to a maximum / A0 from the scatter of A0."""
    return from_scatter(Cause.NOISE, sd_m, amplitude_m, "scatter of A0")


def _of_change(relative: float) -> tuple[Contribution, ...]:
    """Return the contribution to a maximum from slow change over the record; empty without such a change."""
    if relative == 0.0:
        return ()
    return (from_scatter(Cause.CHANCE, relative, 1.0, "slow change over the record"),)


def of_one_draw(found: DwellResponse) -> Contribution:
    """Return the scatter of the largest |x| of a window, from the maxima of its parts."""
    motion = found.displacement.settled
    window = np.where(found.is_clear, np.abs(motion[-found.is_clear.size :]), 0.0)
    blocks = int(min(_BLOCKS, found.window_s * found.drive.frequency_hz / _FEWEST_PERIODS))
    if blocks < _FEWEST_BLOCKS:
        return Contribution(Cause.CHANCE, None, "the window is too short to determine the random error")
    largest = np.max(window[: window.size // blocks * blocks].reshape(blocks, -1), axis=1)
    largest = largest[largest > 0.0]
    if largest.size < _FEWEST_BLOCKS:
        return Contribution(Cause.CHANCE, None, "drop-outs leave too little to determine the random error")
    off = np.abs(largest / np.median(largest) - 1)
    if np.max(off) > max(BURST * np.median(off), _ALIKE):
        return Contribution(Cause.CHANCE, None, "a burst in the window sets the largest |x|; find its cause")
    source = f"largest |x| of {largest.size} parts of the window"
    return from_scatter(Cause.CHANCE, sd_of_largest(largest), float(np.max(largest)), source)


def sd_of_largest(maxima: Reals) -> float:
    """Return the standard deviation of the largest of maxima with a generalised extreme value distribution.

    With the shape k from L-moments (Hosking, Wallis and Wood 1985, Technometrics 27), the largest of n values
    has n^-k times the scale of one value: smaller for a bounded motion, else equal (k = 0). The estimate of k
    is lowered by its standard error, because a k that is too large gives too small a bound.
    """
    if np.ptp(maxima) <= _ALIKE * float(np.mean(maxima)):
        return 0.0
    # Divide by the largest maximum: sums of the smallest floating-point numbers would lose all digits.
    ordered, count = np.sort(maxima) / np.max(maxima), maxima.size
    place = np.arange(count)
    first, second, third = (
        float(np.mean(ordered * weight))
        for weight in (
            np.ones(count),
            place / (count - 1),
            place * (place - 1) / ((count - 1) * (count - 2)),
        )
    )
    skewness = (6 * third - 6 * second + first) / (2 * second - first)
    off = 2 / (3 + skewness) - np.log(2) / np.log(3)
    shape = float(np.clip(7.8590 * off + 2.9554 * off**2 - np.sqrt(_SHAPE_VARIANCE / count), 0.0, 0.5))
    return float(np.std(maxima, ddof=1) * count**-shape)


def sweep_budgets(analysis: SweepAnalysis, overlay: AbstractOverlay[Any] | None) -> tuple[Budget, ...]:
    """Return budgets for base amplitude and largest Responses of a sweep, with their frequencies."""
    found = analysis.response
    top = found.largest(found.response_ii)
    # A residual that sensor noise does not explain may be chaos, of which a sweep is only one sample.
    collides = analysis.collisions.is_colliding | analysis.collisions.is_unexplained
    stated = stated_uncertainties(analysis.facts.bench, analysis.facts.response)
    value_m, sd_m = float(found.drive_amplitude_m[top]), float(found.sd_drive_amplitude_m[top])
    scatter = _NO_DRAWS if collides[top] else from_scatter(Cause.NOISE, sd_m, value_m, "parts of the window")
    amplitude = _amplitude(value_m, stated, scatter, f", at {found.frequency_hz[top]:.4g} Hz")
    return amplitude, *_largest(analysis.facts, found, collides, overlay)


def stepped_budgets(
    analysis: SteppedSineAnalysis, overlay: AbstractOverlay[Any] | None
) -> tuple[Budget, ...]:
    """Return budgets for the largest Responses of the steps, with their frequencies."""
    found = analysis.response
    if not found.response_ii.size:
        return ()
    collides = found.response_i - np.nan_to_num(found.noise_bias_i) > _PEAKED * found.response_ii
    return tuple(_largest(analysis.facts, found, collides, overlay))


def _largest(
    facts: RecordingFacts,
    found: SweepResponse | SteppedResponse,
    collides: Flags,
    overlay: AbstractOverlay[Any] | None,
) -> Iterator[Budget]:
    stated = stated_uncertainties(facts.bench, facts.response)
    rate = f", swept at {abs(found.sweep_rate_hz_per_s):.3g} Hz/s" if isinstance(found, SweepResponse) else ""
    error, sd = found.noise_error_i, found.sd_response_ii
    for name, values, scatter, source in (
        (RESPONSE_I, found.response_i, error, "noise that lifts a maximum"),
        (RESPONSE_II, found.response_ii, sd, "parts of the interval"),
    ):
        top = found.largest(values) if isinstance(found, SweepResponse) else int(np.argmax(values))
        value, at = float(values[top]), f"{found.frequency_hz[top]:.4g} Hz"
        own = [from_scatter(Cause.NOISE, float(scatter[top]), value, source)]
        if isinstance(found, SweepResponse):
            is_hidden = ~found.is_clear | np.isnan(found.response_i)
            # Interpolation over a drop-out misses some motion, so the scatter in that interval is larger.
            if np.any((found.response_ii + 2 * sd)[is_hidden] > found.response_ii[top]):
                own.append(Contribution(Cause.CHANCE, None, "drop-outs may hide the largest value"))
        if collides[top]:
            is_long = name == RESPONSE_II and isinstance(found, SteppedResponse)
            of_window = replace(own[0], cause=Cause.CHANCE) if is_long else _NO_DRAWS
            own = [_scatter(overlay, name, top) or of_window]
        elif name == RESPONSE_I and isinstance(found, SteppedResponse):
            own += _of_change(float(found.slow_change[top]))
        if not collides[top] and name == RESPONSE_I:
            own.append(_of_base(float(found.sd_drive_amplitude_m[top]), float(found.drive_amplitude_m[top])))
            if isinstance(found, SweepResponse) and not _ENDS <= top < values.size - _ENDS:
                own.append(Contribution(Cause.CHANCE, None, "depends on the intervals at a sweep's end"))
        yield Budget(f"largest {name}, at {at}{rate}", value, "", (*_ratio(stated), *own))


def _scatter(overlay: AbstractOverlay[Any] | None, name: str, place: int) -> Contribution | None:
    """Return a value's scatter over draws with the measured kind of motion; None with fewer than 5 draws."""
    curve = None if overlay is None else overlay.quantity(name)
    if curve is None or int(curve.count[place]) < _FEWEST_DRAWS:
        return None
    source = f"{int(curve.count[place])} simulated draws"
    return from_scatter(Cause.CHANCE, float(curve.relative_sd[place]), 1.0, source)
