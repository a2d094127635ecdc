"""What every analysis reads of one recording: its three channels, its facts, levels and checks.

The channels are drive, base and response, from a recording or a simulation of it; block by block.
Facts are what was measured, with what, and how it ended, with what feedback noted while it ran. Checks
say what to look at before trusting it. The format: docs/recording-format.md. Nothing is estimated here.
"""

from ._channel_levels import ChannelLevel, require_moving_channels
from ._channels import (
    BASE,
    DRIVE,
    RESPONSE,
    Channels,
    ObservedChannels,
    ProgressObserver,
    RecordedChannels,
    Stretch,
    Unobserved,
    only_stretch,
    read_whole,
)
from ._checks import (
    Check,
    Verdict,
    measurement_checks,
)
from ._facts import FeedbackNote, RecordingFacts, recording_facts, specimen_of

__all__ = [
    "BASE",
    "DRIVE",
    "RESPONSE",
    "ChannelLevel",
    "Channels",
    "Check",
    "FeedbackNote",
    "ObservedChannels",
    "ProgressObserver",
    "RecordedChannels",
    "RecordingFacts",
    "Stretch",
    "Unobserved",
    "Verdict",
    "measurement_checks",
    "only_stretch",
    "read_whole",
    "recording_facts",
    "require_moving_channels",
    "specimen_of",
]
