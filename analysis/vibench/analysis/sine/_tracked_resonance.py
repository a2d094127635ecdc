"""A mode's resonance at every level at which it was tracked: its backbone.

What feedback found, in sentences: jumps, motions that do not repeat, resonances, missed levels.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from ..recordings import FeedbackNote

LOCALISED = "localised"


@dataclass(frozen=True)
class NotedJump:
    """A jump of a stepped sine between two settled frequencies."""

    direction: str
    low_hz: float
    high_hz: float


def noted_jumps(notes: Sequence[FeedbackNote]) -> tuple[NotedJump, ...]:
    """Give the jumps that were bracketed as closely as the plan asks."""
    found = [each.numbers for each in notes if each.kind == "jump" and each.numbers.get("how") == LOCALISED]
    return tuple(_jump(numbers) for numbers in found)


def feedback_sentences(notes: Sequence[FeedbackNote]) -> Iterator[str]:
    """Say what feedback found; nothing for a measurement without it."""
    jumps = noted_jumps(notes)
    if jumps:
        said = ", ".join(f"{each.low_hz:.5g} and {each.high_hz:.5g} Hz ({each.direction})" for each in jumps)
        yield f"Jumps between {said}."
    steps = [each.numbers for each in notes if each.kind == "achieved" and "motion" in each.numbers]
    periods = sorted({_whole(each, "period") for each in steps if each["motion"] == "periodic"})
    kinds = [f"period {period}: {_count(steps, period)}" for period in periods if period > 1]
    aperiodic = sum(each["motion"] == "aperiodic" for each in steps)
    unsettled = sum(each["motion"] == "unsettled" for each in steps)
    kinds += [f"no period: {aperiodic}"] * bool(aperiodic) + [f"not settled: {unsettled}"] * bool(unsettled)
    if kinds:
        yield f"Of {len(steps)} recorded motions, by kind: {', '.join(kinds)}."
    outside = sum(each.get("level") == "outside tolerance" for each in steps)
    if outside:
        yield f"The base was off its level in {outside} of them."
    yield from (_resonance(each.numbers) for each in notes if each.kind == "resonance")


def _jump(numbers: Mapping[str, int | float | str | None]) -> NotedJump:
    low_hz, high_hz = sorted((_given_number(numbers, "before_hz"), _given_number(numbers, "after_hz")))
    return NotedJump(str(numbers["direction"]), low_hz, high_hz)


def _count(steps: Sequence[Mapping[str, int | float | str | None]], period: int) -> int:
    return sum(each["motion"] == "periodic" and each["period"] == period for each in steps)


def _resonance(numbers: Mapping[str, int | float | str | None]) -> str:
    level = f"{_given_number(numbers, 'asked_m_per_s2'):g} m/s²"
    if numbers.get("frequency_hz") is None:
        return f"No phase resonance at {level}: {numbers['lock']}."
    frequency_hz, u_hz = _given_number(numbers, "frequency_hz"), _given_number(numbers, "frequency_u_hz")
    text = f"Phase resonance at {frequency_hz:.3f} ± {2 * u_hz:.2g} Hz ({level})"
    if numbers.get("mode_hz") is None:
        return f"{text}."
    mode_hz, mode_u_hz = _given_number(numbers, "mode_hz"), _given_number(numbers, "mode_u_hz")
    damping = _given_number(numbers, "damping_ratio")
    return f"{text}; natural frequency {mode_hz:.3f} ± {2 * mode_u_hz:.2g} Hz, damping ratio {damping:.3g}."


def _given_number(numbers: Mapping[str, int | float | str | None], key: str) -> float:
    value = numbers[key]
    assert isinstance(value, int | float), f"{key} of a note is a number"
    return float(value)


def _whole(numbers: Mapping[str, int | float | str | None], key: str) -> int:
    return int(_given_number(numbers, key))


Numbers = Mapping[str, int | float | str | None]


@dataclass(frozen=True)
class TrackedResonance:
    """What was found of a mode at one level of the base."""

    number: int
    """Of the level, in the order played, from 0."""
    base_m_per_s2: float
    """Fundamental of the base's acceleration, peak."""
    frequency_hz: float
    """Where m0 lags the base by the phase asked for."""
    u_frequency_hz: float
    """Standard uncertainty, with that of the sensors' phase, which all levels share."""
    amplitude_m: float
    """Of m0 at the drive frequency."""
    mode_hz: float | None
    """Natural frequency, fitted to both flanks; None where they do not tell it."""
    u_mode_hz: float | None
    damping_ratio: float | None


def tracked_resonances(notes: Sequence[FeedbackNote]) -> tuple[TrackedResonance, ...]:
    """Give the levels at which the resonance was found, weakest first; where it was lost is left out."""
    return tuple(sorted(_found(notes), key=lambda each: each.base_m_per_s2))


def lost_levels(notes: Sequence[FeedbackNote]) -> tuple[float, ...]:
    """Give the levels [m/s²] that were asked for and at which no resonance was found."""
    lost = [
        _required(each.numbers, "asked_m_per_s2")
        for each in notes
        if each.kind == "resonance" and each.numbers.get("frequency_hz") is None
    ]
    return tuple(sorted(lost))


def _found(notes: Sequence[FeedbackNote]) -> Iterator[TrackedResonance]:
    for numbers in (each.numbers for each in notes if each.kind == "resonance"):
        frequency_hz, u_hz = _number(numbers, "frequency_hz"), _number(numbers, "frequency_u_hz")
        if frequency_hz is None or u_hz is None:
            continue
        base, response, at_hz = (_required(numbers, key) for key in ("base_m_per_s2", "response_ii", "at_hz"))
        yield TrackedResonance(
            number=int(_required(numbers, "level")),
            base_m_per_s2=base,
            frequency_hz=frequency_hz,
            u_frequency_hz=u_hz,
            amplitude_m=response * base / (2 * math.pi * at_hz) ** 2,
            mode_hz=_number(numbers, "mode_hz"),
            u_mode_hz=_number(numbers, "mode_u_hz"),
            damping_ratio=_number(numbers, "damping_ratio"),
        )


def _required(numbers: Numbers, key: str) -> float:
    value = _number(numbers, key)
    assert value is not None, f"{key} of a note is a number"
    return value


def _number(numbers: Numbers, key: str) -> float | None:
    value = numbers.get(key)
    return float(value) if isinstance(value, int | float) else None


def backbone_sentence(levels: Sequence[TrackedResonance]) -> str:
    """Say whether a mode softens or hardens from its weakest level to its strongest."""
    if len(levels) < 2:
        return ""
    first, last = levels[0], levels[-1]
    shift_hz = last.frequency_hz - first.frequency_hz
    u_hz = 2 * math.hypot(first.u_frequency_hz, last.u_frequency_hz)
    moved = f"by {shift_hz:+.3g} ± {u_hz:.2g} Hz"
    between = f"From {first.base_m_per_s2:.3g} to {last.base_m_per_s2:.3g} m/s² the phase resonance moves"
    if abs(shift_hz) <= u_hz:
        return f"{between} {moved}: neither softening nor hardening is seen."
    return f"{between} {moved}: the mode {'hardens' if shift_hz > 0 else 'softens'}."
