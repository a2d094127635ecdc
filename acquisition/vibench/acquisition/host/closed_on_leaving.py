"""Things that are closed when the ``with`` that holds them is left, whatever happened in it."""

from abc import ABC, abstractmethod
from types import TracebackType
from typing import Self


class ClosedOnLeaving(ABC):
    """Something that must be closed, and is, at the end of a ``with``."""

    @abstractmethod
    def close(self) -> None:
        """Let go of what is held. Legal at any time."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
