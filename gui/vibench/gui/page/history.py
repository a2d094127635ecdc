"""Edits of a plan that can be taken back."""

from typing import Generic, TypeVar

State = TypeVar("State")
MOST_KEPT = 200


class History(Generic[State]):
    """States of a plan in their order, and where in them it stands."""

    def __init__(self) -> None:
        self._states: list[State] = []
        self._now = -1

    def note(self, state: State) -> None:
        """Note a state that was made; what had been taken back before is forgotten."""
        if self._states and self._states[self._now] == state:
            return
        self._states = [*self._states[: self._now + 1], state][-MOST_KEPT:]
        self._now = len(self._states) - 1

    def undo(self) -> State | None:
        """Go back; None where nothing was before."""
        return self._go(-1)

    def redo(self) -> State | None:
        """Go on; None where nothing comes after."""
        return self._go(1)

    def _go(self, step: int) -> State | None:
        if not 0 <= self._now + step < len(self._states):
            return None
        self._now += step
        return self._states[self._now]
