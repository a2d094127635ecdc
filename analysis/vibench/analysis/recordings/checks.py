"""Checks of a recording, each with a verdict and a text."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import date
from enum import StrEnum
from math import cos, pi
from typing import Any, Generic, TypeVar

from pydantic import ValidationError

from vibench.acquisition.plan import EXCITATION_KINDS, Family, StreamedNoise
from vibench.acquisition.recording import RecordingState, SealState
from vibench.acquisition.rig import GeneratorConfig, size_of_unit

from ..tables import Tabular
from .channels import BASE, DRIVE
from .facts import RecordingFacts


class Verdict(StrEnum):
    """Verdict of a check of a recording."""

    PASSED = "passed"
    NOTE = "note"
    """Nothing is wrong, but the text should be read before the result is used."""
    WARNING = "warning"
    """The result may be wrong, or contains less than was planned."""


@dataclass(frozen=True)
class Check:
    """Result of one check of a recording."""

    what: str
    verdict: Verdict
    text: str


_LEAST_SHARE_OF_RANGE = 1e-3
"""Minimum fraction of the input range that a signal should use, so that the converter resolves it."""
_FARTHEST = 1000.0
"""Largest plausible ratio of the motions of mass and base, or of base and mass, far from a resonance."""
_OFTEN_DARK = 0.01
"""Fraction of a recording in vibrometer drop-outs above which a warning is given."""
_SAME_RATE = 1e-9
_LEVEL_TOLERANCE = 0.05
"""Largest overshoot of the drive, relative to its set level, that noise and converter filter can cause."""
_SHORTFALL = 0.15
"""Largest relative shortfall of the drive peak below its set level; also the limit of a bench check."""


P = TypeVar("P")
R = TypeVar("R")


@dataclass(frozen=True, eq=False)
class AbstractAnalysis(Tabular, Generic[P, R]):
    """Result of the analysis of one recording: facts, checks, plan and response."""

    facts: RecordingFacts
    checks: tuple[Check, ...]
    excitation: P
    response: R


def measurement_checks(facts: RecordingFacts) -> tuple[Check, ...]:
    """Check the end of a recording, overloads, lost samples, levels, rates and calibrations."""
    return (
        _ending(facts),
        _seal(facts),
        _stretches(facts),
        _overloads(facts),
        *_dropouts(facts),
        _lost_samples_check(facts),
        *_drive(facts),
        *_late(facts),
        *_ranges(facts),
        *_scales(facts),
        _rates(facts),
        *_import_checks(facts),
        _calibrations(facts),
        _bench_check(facts),
    )


def _ending(facts: RecordingFacts) -> Check:
    planned = "" if facts.planned_s is None else f" of {facts.planned_s:.1f} s planned"
    why = f": {facts.reason}" if facts.reason else ""
    text = f"{facts.state.value}{why}; {facts.duration_s:.1f} s recorded{planned}"
    verdict = Verdict.PASSED if facts.state is RecordingState.COMPLETE else Verdict.WARNING
    return Check("How it ended", verdict, text)


def _seal(facts: RecordingFacts) -> Check:
    match facts.seal.state:
        case SealState.INTACT:
            verdict = Verdict.PASSED
        case SealState.UNFINISHED:
            verdict = Verdict.NOTE
        case _:
            verdict = Verdict.WARNING
    return Check("Seal", verdict, facts.seal.sentence)


def _stretches(facts: RecordingFacts) -> Check:
    text = f"{facts.whole_stretches} of {facts.planned_stretches} planned parts were recorded completely"
    if facts.whole_stretches > facts.planned_stretches:
        text = f"{facts.whole_stretches} parts were recorded completely; feedback determined their number"
    whole = facts.whole_stretches >= facts.planned_stretches
    if not whole and facts.measurement.until is not None and facts.state is RecordingState.COMPLETE:
        return Check("Parts", Verdict.PASSED, f"{text}; then the requested accuracy was reached")
    return Check("Parts", Verdict.PASSED if whole else Verdict.WARNING, text)


def _overloads(facts: RecordingFacts) -> Check:
    is_noise = facts.measurement.excitation.family is Family.NOISE
    left_out = "realisations, segments or hits with such samples are left out of the transmission"
    flat = {
        each.header.role: f"{each.header.role} at {' and '.join(f'{value:.4g}' for value in each.flat_tops)} "
        f"{each.header.unit}"
        for each in facts.channels
        if each.flat_tops and not (facts.dropouts and each.header.role == facts.response)
    }
    if flat:
        result = "the transmission is" if is_noise else "Responses I and II are"
        what = f"peaks are cut, so {result} wrong; measure again"
        if is_noise and flat.keys() <= facts.overload_s.keys():
            what = left_out
        return Check("Overloads", Verdict.WARNING, f"flat tops: {', '.join(flat.values())}; {what}")
    if not facts.overload_s:
        imported = facts.bench.get("imported", {})
        mapped = imported.get("mapping", {}).get("channels", ())
        both = zip(mapped, imported.get("channels", ()), strict=False)
        unknown = [one["role"] for one, other in both if not (one["full_scale"] or other["full_scale"])]
        if unknown:
            text = f"the full scale of {', '.join(unknown)} is not known, but no flat tops were found"
            return Check("Overloads", Verdict.NOTE, text)
        return Check("Overloads", Verdict.PASSED, "no input came near its full scale")
    parts = [f"{role} for {seconds:.3g} s" for role, seconds in facts.overload_s.items()]
    doubt = "peaks may be cut, so Response I is a lower bound and Response II may be wrong"
    what = left_out if is_noise else doubt
    if facts.dropouts and facts.response in facts.overload_s:
        what = (
            "the vibrometer lost its signal for longer than can be bridged, or peaks were cut: check the "
            "velocity at these times, and do not trust Response I"
        )
    return Check("Overloads", Verdict.WARNING, f"near full scale: {', '.join(parts)}; {what}")


def _dropouts(facts: RecordingFacts) -> Iterator[Check]:
    if facts.dropouts:
        times = "once" if facts.dropouts == 1 else f"{facts.dropouts} times"
        text = (
            f"the vibrometer lost its signal {times}, for {facts.dropout_s:.2g} s in total; the motion was "
            "interpolated at these times, which misses effects of impacts. Refocus the laser, or apply "
            "reflective tape"
        )
        often = facts.dropout_s > _OFTEN_DARK * facts.duration_s
        yield Check("Drop-outs", Verdict.WARNING if often else Verdict.NOTE, text)


def _lost_samples_check(facts: RecordingFacts) -> Check:
    if facts.lost_samples == 0:
        return Check("Lost samples", Verdict.PASSED, "none")
    text = f"{facts.lost_samples} samples were lost; segments that contain them are left out"
    return Check("Lost samples", Verdict.WARNING, text)


def _drive(facts: RecordingFacts) -> Iterator[Check]:
    setting_v = facts.measurement.excitation.highest_amplitude_vpp / 2
    reached_v = facts.level(DRIVE).peak
    text = f"a peak of {reached_v:.4g} V was recorded for a setting of {2 * setting_v:g} V peak to peak"
    if reached_v < _least_peak_v(facts):
        text += "; the drive was weaker than planned: results refer to the recorded levels"
        yield Check("Drive level", Verdict.WARNING, text)
        return
    is_high = reached_v > setting_v * (1 + _LEVEL_TOLERANCE)
    yield Check("Drive level", Verdict.NOTE if is_high else Verdict.PASSED, text)


def _least_peak_v(facts: RecordingFacts) -> float:
    """Return the lowest expected peak of the drive; 0 if no peak can be expected.

    Feedback control may stay below its set level, and the peak of streamed noise is random. With few samples
    per period, the peak of a sine may fall between samples.
    """
    excitation = facts.measurement.excitation
    is_open_ended = EXCITATION_KINDS[excitation.kind].is_feedback or isinstance(excitation, StreamedNoise)
    if facts.state is not RecordingState.COMPLETE or is_open_ended:
        return 0.0
    try:
        generator = GeneratorConfig.model_validate(facts.bench.get("generator"))
    except ValidationError:  # the recording was imported, or is of another version
        return 0.0
    terminal_v = excitation.highest_amplitude_vpp / 2 * generator.terminal_factor()
    missed = cos(pi * min(0.5, excitation.band_hz[1] / facts.sample_rate_hz))
    return terminal_v * (1 - _SHORTFALL) * missed


def _late(facts: RecordingFacts) -> Iterator[Check]:
    if facts.late:
        text = f"{facts.late[0]}; {len(facts.late)} such {'event' if len(facts.late) == 1 else 'events'}"
        yield Check("Timing of the drive", Verdict.WARNING, text)


def _ranges(facts: RecordingFacts) -> Iterator[Check]:
    for each in (one for one in facts.channels if one.share_of_range < _LEAST_SHARE_OF_RANGE):
        text = f"{each.header.role} used {100 * each.share_of_range:.2g} % of its range; a smaller range fits"
        yield Check("Range", Verdict.NOTE, text)


def _scales(facts: RecordingFacts) -> Iterator[Check]:
    base, response = (facts.level(role) for role in (BASE, facts.response))
    order = {"velocity": 1, "displacement": 2}.get(response.header.quantity, 0)
    low_hz, high_hz = facts.measurement.excitation.band_hz
    low, high = ((2 * pi * hz) ** order * response.span for hz in (low_hz, high_hz))
    # Without damping, a resonant amplitude grows every second by pi f times the amplitude of the base.
    farthest = max(_FARTHEST, 3 * pi * high_hz * facts.duration_s)
    is_absurd = low > farthest * base.span > 0 or high * _FARTHEST < base.span
    if is_absurd and response.header.quantity != "force" and is_acceleration(base.header.role, facts.bench):
        text = (
            f"the mass moved about {low / base.span:.2g} times as far as the base; check the scales or "
            f"sensitivities of {facts.response} and {BASE}"
        )
        yield Check("Scales", Verdict.WARNING, text)


def is_acceleration(role: str, bench: Mapping[str, Any]) -> bool:
    """Return False if a channel was imported from the drive, or from a file that states another quantity."""
    imported = bench.get("imported", {})
    both = zip(imported.get("mapping", {}).get("channels", ()), imported.get("channels", ()), strict=False)
    known = {one["role"]: (one["source"], one["file_unit"] or other["unit"]) for one, other in both}
    source, unit = known.get(role, ("", ""))
    is_drive = source != "" and source == known.get(DRIVE, ("",))[0]
    return not is_drive and (not unit or size_of_unit(unit, "m s-2") is not None)


def _rates(facts: RecordingFacts) -> Check:
    actual, wanted = facts.sample_rate_hz, facts.requested_sample_rate_hz
    same = abs(actual - wanted) <= _SAME_RATE * wanted
    text = f"{actual:.6g} samples/s" + ("" if same else f", where {wanted:.6g} were requested")
    return Check("Sample rate", Verdict.PASSED if same else Verdict.NOTE, text)


def _import_checks(facts: RecordingFacts) -> Iterator[Check]:
    imported = facts.bench.get("imported", {})
    if held := imported.get("held", ()):
        text = (
            f"{'; '.join(held)}, as if a converter was stuck or zeros were added; these samples are left out"
        )
        yield Check("Held values", Verdict.WARNING, text)
    if remarks := imported.get("time", ()):
        verdict = Verdict.WARNING if imported.get("time_contradicted") else Verdict.NOTE
        yield Check("Time of the imported file", verdict, "; ".join(remarks))


def _calibrations(facts: RecordingFacts) -> Check:
    valid_days = int(facts.bench.get("calibration_valid_days", 0))
    measured = date.fromisoformat(facts.started_utc[:10])
    dated = [each.header for each in facts.channels if each.header.calibration_date]
    if not dated or not valid_days:
        return Check("Calibration", Verdict.NOTE, "the recording contains no calibration dates")
    ages = {each.role: (measured - date.fromisoformat(each.calibration_date)).days for each in dated}
    later = [f"{each.role} ({each.calibration_date})" for each in dated if ages[each.role] < 0]
    if later:
        text = f"dated after the measurement on {measured}: {', '.join(later)}; check the certificates"
        return Check("Calibration", Verdict.WARNING, text)
    stale = [f"{role} ({days} days)" for role, days in ages.items() if days > valid_days]
    if stale:
        text = f"expired on the day of the measurement: {', '.join(stale)}; {valid_days} days are allowed"
        return Check("Calibration", Verdict.WARNING, text)
    return Check("Calibration", Verdict.PASSED, f"all channels within {valid_days} days")


def _bench_check(facts: RecordingFacts) -> Check:
    if not facts.check:
        return Check("Bench check", Verdict.NOTE, "the recording contains no check of the bench")
    return Check("Bench check", Verdict.PASSED, facts.check)
