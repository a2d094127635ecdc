"""What goes wrong between an engine and those who ask it."""

from ..errors import AcquisitionError


class EngineError(AcquisitionError):
    """The engine does not do what was asked; the text says what state it is in and what is allowed."""


class EngineGone(EngineError, ConnectionError):
    """The engine's process has ended, or cannot be reached."""


class EngineSilent(EngineGone):
    """The engine has not answered in time; its process may live."""
