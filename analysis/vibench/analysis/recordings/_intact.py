"""Whether a recording may be believed: held against its seal before any number is taken from it."""

from vibench.acquisition.recording import Recording, SealCheck, SealDepth, SealState

from ..errors import UnusableData


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
