"""What happens in a campaign, told to whoever writes it down or passes it on."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum


class CampaignEventKind(StrEnum):
    """What happened."""

    BEGUN = "begun"
    RESUMED = "resumed"
    POINT_BEGUN = "point_begun"
    POINT_DONE = "point_done"
    POINT_STOPPED = "point_stopped"
    FAULT = "fault"
    """An attempt failed, or the campaign met something that ends it."""
    DAMAGED = "damaged"
    """A recording that was complete is not as it was sealed, or is gone; its point is made again."""
    RETRY = "retry"
    RESTING = "resting"
    """Silence between two recordings."""
    BENCH_REOPENED = "bench_reopened"
    FURTHER = "further"
    """A result asked for more measurements."""
    ENDED = "ended"
    NOTICE = "notice"
    """Somebody was told, or could not be reached."""


@dataclass(frozen=True)
class CampaignEvent:
    """One thing that happened, as a sentence and as facts."""

    kind: CampaignEventKind
    text: str
    facts: Mapping[str, str | int | float] = field(default_factory=dict)


CampaignListener = Callable[[CampaignEvent], None]
"""Told of every event, in order; must not raise."""


def ignore_event(event: CampaignEvent) -> None:
    """Tell nobody."""
