"""The HDF5 recording: its layout, writing, finalising, recovering and reading.

The names below are how the rest of the house, and scripts of users, reach it.
"""

from .header import ChannelHeader, RecordingHeader
from .layout import Origin, RecordingState
from .reader import Recording, open_recording
from .recover import recover
from .results import ResultArray, SavedResult
from .writer import RecordingWriter, create_recording

__all__ = [
    "ChannelHeader",
    "Origin",
    "Recording",
    "RecordingHeader",
    "RecordingState",
    "RecordingWriter",
    "ResultArray",
    "SavedResult",
    "create_recording",
    "open_recording",
    "recover",
]
