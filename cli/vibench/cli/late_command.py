"""Commands by name only: what a command needs is imported when it is called, not to list it."""

import importlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup


@dataclass(frozen=True)
class Place:
    """Where a command is written, and its line in the list of commands."""

    module: str
    function: str
    summary: str
    """First line of the function's docstring."""

    def load(self) -> typer.Typer:
        """Import the command, alone in an application of its own."""
        found = getattr(importlib.import_module(f".{self.module}", __package__), self.function)
        if isinstance(found, typer.Typer):
            return found
        application = typer.Typer(add_completion=False)
        application.command()(found)
        return application


class LateCommand(TyperCommand):
    """Stands in the list for a command, and hands over to it once it is called."""

    def __init__(self, name: str, place: Place) -> None:
        super().__init__(name, help=place.summary)
        self._place = place

    def make_context(self, info_name: str | None, args: list[str], *given: Any, **named: Any) -> Any:
        """Read the arguments as the command itself does."""
        command = typer.main.get_command(self._place.load())
        command.name = self.name
        return command.make_context(info_name, args, *given, **named)


def late_commands(places: Mapping[str, Place]) -> type[TyperGroup]:
    """Make the class of a group of commands, in this order."""

    class LateCommands(TyperGroup):
        def __init__(self, **settings: Any) -> None:
            super().__init__(**settings)
            self.commands = {name: LateCommand(name, place) for name, place in places.items()}

    return LateCommands
