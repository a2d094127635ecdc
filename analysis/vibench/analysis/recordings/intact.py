"""Whether a recording may be believed: held against its seal before any number is taken from it."""

from vibench.acquisition.recording import Recording, SealCheck, SealDepth, SealState

from ..errors import UnusableData

MOST_BYTES = 1e9
"""Of memory, for what need not be held against the file's size."""
BYTES_A_SAMPLE = 80
"""Of a stretch that is analysed at once: three channels, and what is made of them."""
LARGEST_PACKING = 16.0
"""Converters hear noise: it packs 1.2 to 3 times, a computed sine without any 6 times."""


def require_measured_size(recording: Recording) -> None:
    """Refuse a small file that declares more than fits into memory; raises UnusableData.

    Every other recording takes memory in proportion to the size of its file.
    """
    if recording.samples * BYTES_A_SAMPLE > MOST_BYTES and recording.packing > LARGEST_PACKING:
        raise UnusableData(
            f"{recording.path.name} declares {recording.samples} samples, and holds them in one part of "
            f"{recording.packing:.0f}: no converter gives what can be packed so. Nothing was read; if it was "
            "computed and is meant so, read it with h5py, or export some seconds of it (--from, --until)"
        )


def require_checked(recording: Recording) -> None:
    """Hold a recording against its seal, where this process has not done so; raises as `require_intact`."""
    if not recording.is_checked:
        require_intact(recording)


def require_intact(recording: Recording) -> SealCheck:
    """Hold every sample, attribute and table against the seal; gives what was found.

    A recording without a seal, made before there were any or not finished yet, is let pass. Raises
    UnusableData when something is not as it was sealed.
    """
    found = recording.check_seal(SealDepth.WHOLE)
    if found.state is SealState.DAMAGED:
        raise UnusableData(
            f"{recording.path.name} is damaged ({found.sentence}), so no number of it can be trusted; "
            "restore it from a copy, or measure again"
        )
    return found
