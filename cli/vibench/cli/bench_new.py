"""`vibench bench new`: from nothing to a bench that is checked, with a page that says so."""

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
"""Answers to whether a wire is plugged in, false among them, that say that it is not."""


@dataclass(frozen=True)
class Answers:
    """What a file answers: configuration, operator, whether all is wired and every knob as the file says."""

    given: Mapping[str, str]

    @classmethod
    def read(cls, path: Path) -> "Answers":
        """Read a TOML file of answers."""
        return cls({key: str(value) for key, value in _flat(toml_table(path))})

    @property
    def questions(self) -> tuple[Question, ...]:
        """What is asked, and what else of the template is answered."""
        usual = {question.key for question in QUESTIONS} | {_WIRED, _OPERATOR, _KNOBS}
        return (*QUESTIONS, *(Question(key, key) for key in self.given if key not in usual))

    def ask(self, question: Question, choices: Sequence[str], held: str) -> str:
        """Answer a question of the configuration; nothing: as the template has it."""
        answer = self.given.get(question.key, "")
        if choices:
            console.print(f"seen: {', '.join(choices)}")
        console.print(f"{question.text} [{held}] {answer}")
        return answer

    def wired(self, pair: str) -> str:
        """Return whether a pair of ends is plugged in."""
        answer = self.given.get(_WIRED, "")
        console.print(f"Plug {pair}: {answer}")
        return "" if answer.strip().casefold() in _NOT_YET else answer

    def knobs(self, knobs: tuple[Knob, ...]) -> KnobSheet:
        """Confirm every setting made by hand, or none."""
        if self.given.get(_KNOBS) != "as in the file":
            raise CheckFailed(
                'settings made by hand are not confirmed; give knobs = "as in the file" among the answers '
                "once you have compared them"
            )
        return KnobSheet(operator=self.operator, confirmed=datetime.now(UTC), knobs=knobs)

    @property
    def operator(self) -> str:
        """Who answers."""
        return _name_in_a_comment(self.given.get(_OPERATOR, ""))


def _name_in_a_comment(answer: str) -> str:
    """Leave out what would end a line of the configuration, or cannot be written at all."""
    return "".join(letter for letter in answer if letter.isprintable()).strip() or "nobody named"


def _flat(table: Mapping[str, Any], before: str = "") -> list[tuple[str, Any]]:
    found: list[tuple[str, Any]] = []
    for key, value in table.items():
        if isinstance(value, dict):
            found += _flat(value, f"{before}{key}.")
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
        raise CheckStopped("the first day was stopped at its questions; nothing is written") from stop


@_allow_interrupt()
def _operator_at_terminal() -> str:
    return _name_in_a_comment(str(typer.prompt("Who sets up this bench?")))


@_allow_interrupt()
def _configure(template: Path, target: Path, seen: InstrumentList, note: str) -> Rig:
    return configure(template, target, seen, _ask, note, refuse=_report_refusal)


def _report_refusal(error: ConfigurationError) -> None:
    console.print(f"! {error}")


def _confirm_wire(target: Path, pair: str) -> str:
    """Ask whether a wire is plugged in; nothing plays meanwhile, and Ctrl-C ends the program at once."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return "plugged in, by eye" if typer.confirm(f"Plug {pair}. Done?") else ""
    except (KeyboardInterrupt, typer.Abort) as stop:
        raise CheckStopped(
            "the first day was stopped at its wires, before anything played; the configuration is written: "
            f"go on with `vibench bench check --bench {in_a_command(target)}`"
        ) from stop
    finally:
        signal.signal(signal.SIGINT, before)


def new_bench(target: Path, template: Path, answers: Path | None) -> DayPage:
    """Ask, write the configuration, go through the first day, and keep its page beside the file."""
    given = None if answers is None else Answers.read(answers)
    if given is None and not sys.stdin.isatty():
        raise ConfigurationError(
            "nobody sits at this terminal, and there are no answers; give --answers FILE.toml"
        )
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
    console.print(f"kept: {kept}")
    return page


def _day(rig: Rig, target: Path, operator: str, given: Answers | None) -> DayPage:
    confirm: Confirm | None = None if given is None or rig.virtual is not None else given.knobs
    wired, switch = partial(_confirm_wire, target) if given is None else given.wired, StopSwitch()
    with open_bench(rig, confirm) as bench, stop_on_signal(switch, "bench new"):
        return first_day(bench, target, operator, wired, switch)
