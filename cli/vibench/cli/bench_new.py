"""`vibench bench new`: set up a new bench, check it, and write a report about the bench."""

import signal
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import typer

from vibench.acquisition import (
    CheckFailed,
    CheckStopped,
    ConfigurationError,
    InstrumentList,
    StopSwitch,
    list_rig_instruments,
    open_bench,
    stop_on_signal,
)
from vibench.acquisition.first_day.configured import (
    QUESTIONS,
    DayPage,
    Question,
    configure,
    first_day,
    in_a_command,
)
from vibench.acquisition.instruments import Knob
from vibench.acquisition.rig import Confirm, KnobSheet, Rig, load_rig
from vibench.sim import toml_table
from vibench.sim.operating_system.this import replace_file

from .output import console, paragraph
from .paths import free_path

_WIRED, _OPERATOR, _KNOBS = "wired", "operator", "knobs"
_NOT_YET = {"", "no", "n", "not yet", "false", "0"}
"""Answers of the operator that mean that a cable is not plugged in."""


@dataclass(frozen=True)
class Answers:
    """Content of an answer file: configuration values, operator, wired connectors, confirmed knobs."""

    given: Mapping[str, str]

    @classmethod
    def read(cls, path: Path) -> "Answers":
        """Return the operator's answers from a TOML file."""
        return cls({key: str(value) for key, value in _flatten(toml_table(path))})

    @property
    def questions(self) -> tuple[Question, ...]:
        """Return the usual questions, and one more for each other configuration value in the answer file."""
        usual = {question.key for question in QUESTIONS} | {_WIRED, _OPERATOR, _KNOBS}
        return (*QUESTIONS, *(Question(key, key) for key in self.given if key not in usual))

    def ask(self, question: Question, choices: Sequence[str], held: str) -> str:
        """Return the answer to a question about the configuration; no answer keeps the template's value."""
        answer = self.given.get(question.key, "")
        if choices:
            console.print(f"found: {', '.join(choices)}")
        console.print(f"{question.text} [{held}] {answer}")
        return answer

    def connection(self, pair: str) -> str:
        """Return the answer to the question whether a pair of connectors is wired; empty means no."""
        answer = self.given.get(_WIRED, "")
        console.print(f"Plug {pair}: {answer}")
        return "" if answer.strip().casefold() in _NOT_YET else answer

    def knobs(self, knobs: tuple[Knob, ...]) -> KnobSheet:
        """Return the operator's confirmation of all settings made by hand; raise CheckFailed without it."""
        if self.given.get(_KNOBS) != "as in the file":
            raise CheckFailed(
                "settings made by hand are not confirmed; compare them with the configuration, then give "
                'knobs = "as in the file" in the answers'
            )
        return KnobSheet(operator=self.operator, confirmed=datetime.now(UTC), knobs=knobs)

    @property
    def operator(self) -> str:
        """Name of the operator who sets up the bench."""
        return _name_in_a_comment(self.given.get(_OPERATOR, ""))


def _name_in_a_comment(answer: str) -> str:
    """Return a name without line ends and unprintable characters, for a comment in the TOML file."""
    return "".join(letter for letter in answer if letter.isprintable()).strip() or "nobody named"


def _flatten(table: Mapping[str, Any], before: str = "") -> list[tuple[str, Any]]:
    found: list[tuple[str, Any]] = []
    for key, value in table.items():
        if isinstance(value, dict):
            found += _flatten(value, f"{before}{key}.")
        else:
            found.append((f"{before}{key}", value))
    return found


def _ask(question: Question, choices: Sequence[str], held: str) -> str:
    for number, choice in enumerate(choices, start=1):
        console.print(f"  {number}: {choice}")
    answer = str(typer.prompt(f"{question.text} [{held}]", default="", show_default=False))
    if answer.isdigit() and 1 <= int(answer) <= len(choices):
        return choices[int(answer) - 1]
    return answer


@contextmanager
def _allow_interrupt() -> Iterator[None]:
    try:
        yield
    except typer.Abort as stop:
        raise CheckStopped("the setup was stopped during its questions; nothing was written") from stop


@_allow_interrupt()
def _operator_at_terminal() -> str:
    return _name_in_a_comment(str(typer.prompt("Who sets up this bench?")))


@_allow_interrupt()
def _configure(template: Path, target: Path, seen: InstrumentList, note: str) -> Rig:
    return configure(template, target, seen, _ask, note, refuse=lambda error: console.print(f"! {error}"))


def _confirm_wire(target: Path, pair: str) -> str:
    """Ask whether a cable is plugged in; Ctrl-C may end the program at once, because nothing is driven."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return "plugged in, by eye" if typer.confirm(f"Plug {pair}. Done?") else ""
    except (KeyboardInterrupt, typer.Abort) as stop:
        raise CheckStopped(
            "the setup was stopped while wires were plugged in, before any output; the configuration was "
            f"written: continue with `vibench bench check --bench {in_a_command(target)}`"
        ) from stop
    finally:
        signal.signal(signal.SIGINT, before)


def new_bench(target: Path, template: Path, answers: Path | None) -> DayPage:
    """Ask the questions, write the configuration, check the new bench, and write the report."""
    given = None if answers is None else Answers.read(answers)
    if given is None and not sys.stdin.isatty():
        raise ConfigurationError("the questions need a terminal, but there is none; give --answers FILE.toml")
    seen = list_rig_instruments(load_rig(template))
    for remark in seen.remarks:
        console.print(f"! {remark}")
    operator = _operator_at_terminal() if given is None else given.operator
    note = f"{operator}, {datetime.now(UTC).astimezone().date()}"
    if given is None:
        rig = _configure(template, target, seen, note)
    else:
        rig = configure(template, target, seen, given.ask, note, given.questions)
    console.print()
    console.print(f"written: {target}")
    console.print()
    page = _day(rig, target, operator, given)
    kept = free_path(target.with_suffix(".first_day.md"))
    with replace_file(kept) as coming:
        coming.write_text(page.text, encoding="utf-8")
    console.print(paragraph(page.text))
    console.print(f"report: {kept}")
    return page


def _day(rig: Rig, target: Path, operator: str, given: Answers | None) -> DayPage:
    confirm: Confirm | None = None if given is None or rig.virtual is not None else given.knobs
    wired, switch = partial(_confirm_wire, target) if given is None else given.connection, StopSwitch()
    with open_bench(rig, confirm) as bench, stop_on_signal(switch, "bench new"):
        return first_day(bench, target, operator, wired, switch)
