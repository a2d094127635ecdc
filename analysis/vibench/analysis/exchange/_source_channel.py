"""One channel of somebody else's file."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SourceChannel:
    """What the file says of it."""

    name: str
    """How a mapping names it; no other channel of the file has it."""
    samples: int
    label: str = ""
    """What its maker called it; others may be called the same."""
    sample_rate_hz: float | None = None
    """None when the file does not say."""
    unit: str = ""
    step: float | None = None
    """Distance of neighbouring values when they come from integers, so that they are kept exactly."""
    full_scale: float | None = None
    """Largest value the file can hold, where that is the converter's range."""
