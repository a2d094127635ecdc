"""A mode's resonance at every level at which it was tracked: its backbone."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from ..recordings import FeedbackNote

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
