"""What feedback found, in sentences: jumps, motions that do not repeat, resonances, missed levels."""

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
