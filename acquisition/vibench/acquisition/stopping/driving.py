"""Drives of this process that may be on: a stop is confirmed when there are none."""


class DrivesOn:
    """Drives that have started and are not yet confirmed as off."""

    def __init__(self) -> None:
        self._drives: set[object] = set()
        self._has_advanced = False

    def __bool__(self) -> bool:
        """Whether any drive may be on."""
        return bool(self._drives)

    def begin(self, drive: object) -> None:
        """Note that a drive may be on. The output was read back as off before, whatever was unconfirmed."""
        self._drives = {drive}

    def confirm_silence(self, drive: object) -> None:
        """Note that its output was read back as off. Legal at any time."""
        self._drives.discard(drive)

    def note_advance(self) -> None:
        """Note that the run of a drive goes on, or ramps down."""
        self._has_advanced = True

    def take_advance(self) -> bool:
        """Return whether a run has gone on since the last call."""
        advanced, self._has_advanced = self._has_advanced, False
        return advanced


DRIVES_ON = DrivesOn()
"""Of this process."""
