"""`vibench bench`: list, set up and check instruments."""

import signal
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from vibench.acquisition import (
    CheckFailed,
    CheckResult,
    CheckStopped,
    ConfigurationError,
    InstrumentList,
    StopSwitch,
    Verdict,
    check_bench,
    file_path,
    last_check,
    list_instruments,
    list_rig_instruments,
    open_bench,
    stop_on_signal,
)
from vibench.acquisition.first_day import (
    QUESTIONS,
    DayPage,
    Question,
    configure,
    first_day,
    in_a_command,
)
from vibench.acquisition.instruments import Knob, PlugInKind, plug_in_names
from vibench.acquisition.rig import (
    Confirm,
    KnobSheet,
    Rig,
    load_rig,
    save_knob_sheet,
)
from vibench.sim import toml_table
from vibench.sim.operating_system.this import replace_file

from .options import SectionedCommand, SectionedGroup, option, with_options
from .output import ExitCode, bold, console, paragraph, print_json
from .paths import AsJson, BenchPath, bench_path, free_path

bench = typer.Typer(
    help="Check and list instruments.",
    cls=SectionedGroup,
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
)


@bench.command("list", cls=SectionedCommand)
@with_options
def list_bench(
    bench: Annotated[
        Path | None, option("Search at the addresses of this rig; by default on this computer.", "BENCH")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """List the connected instruments and the installed plug-ins, by name."""
    found = list_instruments() if bench is None else list_rig_instruments(load_rig(bench))
    devices = [f"{device.name}: {device.product}, serial {device.serial}" for device in found.daq_devices]
    plug_ins = [f"{kind.value}: {', '.join(plug_in_names(kind))}" for kind in PlugInKind]
    titles = {"VISA": found.visa_resources, "DAQ": devices, "Plug-ins": plug_ins, "Remarks": found.remarks}
    if as_json:
        print_json({title.lower(): list(lines) for title, lines in titles.items()})
        return
    for title, lines in titles.items():
        console.print(bold(title))
        for line in lines or ("none",):
            console.print(f"  {line}")


@bench.command("check", cls=SectionedCommand)
@with_options
def check(
    bench: BenchPath = None,
    out: Annotated[Path, option("Folder of recordings whose free disk space is checked.", "DIR")] = Path(),
    knobs: Annotated[
        Path | None, option("New file for the confirmed settings, used by `measure --knobs`.", "SHEET.toml")
    ] = None,
    last: Annotated[bool, option("Show the result of the last check, without using the bench.")] = False,
    new_reference: Annotated[
        bool, option("Make this check the reference, because the bench was changed on purpose.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Check the bench with a small sine: identities, noise, gains, signs, clocks, disk, and changes.

    The result is stored, because arming a real bench needs a recent passed check. Exit code 1 after a FAIL.
    """
    if last and (knobs is not None or new_reference):
        raise ConfigurationError(
            "--last only shows an earlier check, but --knobs and --new-reference need a new check. Nothing "
            "was done; leave out --last or the other option"
        )
    path = bench_path(bench)
    result = _last(load_rig(path)) if last else _run_check(path, out, knobs, new_reference=new_reference)
    if as_json:
        print_json(result.model_dump(mode="json"))
    else:
        console.print(f"{result.rig}: {result.verdict.value}, {result.checked:%Y-%m-%d %H:%M %Z}")
        console.print(paragraph(result.report.text()))
    if result.verdict is Verdict.FAIL:
        raise typer.Exit(ExitCode.FAILED)


@bench.command("new", cls=SectionedCommand)
@with_options
def new(
    target: Annotated[Path, typer.Argument(metavar="BENCH.toml", help="File of the configuration.")],
    template: Annotated[
        str, option("Configuration with the proposed values.", "NAME|FILE", name="--from")
    ] = "lab_rig",
    answers: Annotated[Path | None, option("Answers to all questions.", "FILE.toml")] = None,
) -> None:
    """Set up a bench: ask questions, write its file, check wiring, noise, gains and signs (first at 5 mV).

    The report is stored beside the file. Exit code 1 if a finding forbids switching the amplifier on.
    """
    page = new_bench(target, file_path(template, "hardware_configs"), answers)
    if page.verdict is Verdict.FAIL:
        raise typer.Exit(ExitCode.FAILED)


def _run_check(path: Path, out: Path, knobs: Path | None, *, new_reference: bool) -> CheckResult:
    rig, switch = load_rig(path), StopSwitch()
    with open_bench(rig) as opened, stop_on_signal(switch, "bench check"):
        if knobs is not None:
            save_knob_sheet(opened.confirmations, knobs)
        return check_bench(opened, out, switch=switch, new_reference=new_reference)


def _last(rig: Rig) -> CheckResult:
    result = last_check(rig.name)
    if result is None:
        raise CheckFailed(
            f"the bench {rig.name!r} was never checked on this account, so nothing can be shown; leave out "
            "--last to check the bench"
        )
    return result


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
        """Return the usual questions, and one for each further configuration value in the answer file."""
        usual = {question.key for question in QUESTIONS} | {_WIRED, _OPERATOR, _KNOBS}
        return (*QUESTIONS, *(Question(key, key) for key in self.given if key not in usual))

    def ask(self, question: Question, choices: Sequence[str], held: str) -> str:
        """Return the answer to a question about the configuration; if empty, keep the template's value."""
        answer = self.given.get(question.key, "")
        if choices:
            console.print(f"found: {', '.join(choices)}")
        console.print(f"{question.text} [{held}] {answer}")
        return answer

    def connection(self, pair: str) -> str:
        """Return the answer to the question whether two connectors are wired; an empty answer means no."""
        answer = self.given.get(_WIRED, "")
        console.print(f"Plug {pair}: {answer}")
        return "" if answer.strip().casefold() in _NOT_YET else answer

    def knobs(self, knobs: tuple[Knob, ...]) -> KnobSheet:
        """Return the operator's confirmation of all settings made by hand; else raise CheckFailed."""
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


def _ask_at_terminal(question: Question, choices: Sequence[str], held: str) -> str:
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
    return configure(
        template, target, seen, _ask_at_terminal, note, refuse=lambda error: console.print(f"! {error}")
    )


def _confirm_wire(target: Path, pair: str) -> str:
    """Ask whether a cable is plugged in; Ctrl-C may end the program at once, because no drive is on."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return "plugged in, by eye" if typer.confirm(f"Plug {pair}. Done?") else ""
    except (KeyboardInterrupt, typer.Abort) as stop:
        raise CheckStopped(
            "the setup was stopped while wires were plugged in, before any signal was played; the "
            f"configuration was written: continue with `vibench bench check --bench {in_a_command(target)}`"
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
