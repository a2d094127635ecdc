"""The `vibench` command: its list of commands, and the one place where an error becomes a sentence.

Commands by name only: what a command needs is imported when it is called, not to list it.
"""

import errno
import importlib
import logging
import os
import sys
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from typing import Annotated, Any, TextIO

import typer
from rich.text import Text
from typer.core import TyperCommand

from vibench.acquisition import (
    AcquisitionError,
    Beside,
    CheckStopped,
    need_extra,
    need_space,
    printable,
    shortened,
)
from vibench.analysis import AnalysisError
from vibench.sim import UnreadableTomlError
from vibench.sim.study import StudyError
from vibench.stop_files import SWITCH_OFF

from . import blas_threads  # noqa: F401 - numpy reads its setting, so it comes first
from .exit_code import ExitCode
from .options import SectionedCommand, SectionedGroup, with_options
from .output import errors


class Panel(StrEnum):
    """Headings of the list of commands."""

    MEASURE = "Measure"
    ANALYSE = "Analyse"
    PREDICT = "Predict"
    BENCH = "Bench"
    FILES = "Files"
    INSTALLATION = "Installation"


@dataclass(frozen=True)
class Place:
    """Where a command is written, and its line in the list of commands."""

    module: str
    function: str
    summary: str
    """First line of the function's docstring."""
    panel: Panel
    extras: tuple[str, ...] = ()
    """Extras that it needs before it does anything, the one that brings the others first."""
    space_mb: int = 300
    """Address space that its libraries and their threads take [MB]."""
    advice: str = ""
    """What to do where it cannot run."""

    def load(self) -> typer.Typer:
        """Import the command, alone in an application of its own."""
        found = getattr(importlib.import_module(f".{self.module}", __package__), self.function)
        if isinstance(found, typer.Typer):
            return found
        application = typer.Typer(add_completion=False, rich_markup_mode=None)
        application.command(cls=SectionedCommand)(with_options(found))
        return application


class LateCommand(TyperCommand):
    """Stands in the list for a command, and hands over to it once it is called."""

    def __init__(self, name: str, place: Place) -> None:
        super().__init__(name, help=place.summary, rich_help_panel=place.panel)
        self._place = place

    def make_context(self, info_name: str | None, args: list[str], *given: Any, **named: Any) -> Any:
        """Read the arguments as the command itself does."""
        if not named.get("resilient_parsing"):
            need_space(self._place.space_mb, self._place.advice)
        command = typer.main.get_command(self._place.load())
        command.name = self.name
        with told_in_full([] if named.get("resilient_parsing") else args):
            context = command.make_context(info_name, [*args], *given, **named)
        if not named.get("resilient_parsing"):
            for extra in self._place.extras:
                need_extra(extra)
        return context


_USAGE_ERROR: Any = typer.BadParameter.__mro__[1]
"""What is wrong with a command line: a class of click, or of the copy of click in newer typer."""


@contextmanager
def told_in_full(args: Sequence[str]) -> Iterator[None]:
    """Refuse arguments with nothing in them, and say of an option what stands there and what may."""
    words = ["", *(part for each in args for part in (each.split("=", 1) if each[:2] == "--" else [each]))]
    empty = next((before for before, word in pairwise(words) if not word), None)
    if empty is not None:
        place = empty if empty.startswith("--") else "an argument"
        raise typer.BadParameter(
            f"{place} was given as '', with nothing in it; give a value, or leave it out. A variable of the "
            "shell that is not set leaves nothing there."
        )
    try:
        yield
    except _USAGE_ERROR as error:
        if isinstance(error, typer.BadParameter):
            _name_what_was_given(error, words)
        if args:  # without any, the message is the help
            error.message = printable(error.message)
        raise


def _name_what_was_given(error: typer.BadParameter, words: Sequence[str]) -> None:
    error.message = error.message.removeprefix("Value error, ")
    names = () if error.param is None else error.param.opts
    given = next((word for before, word in pairwise(words) if before in names), None)
    if given is None:
        return
    if any(kind in error.message for kind in ("number", "float", "integer")) and not _is_number(given):
        advice = "give one in SI units and without their names, such as 5 or 5e-6"
        error.message = f"{given!r} is no number; {advice}."
    elif error.message.startswith("Input should be "):
        error.message = f"{given!r} was given; it {error.message.removeprefix('Input ').partition(', ')[0]}."


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def late_commands(places: Mapping[str, Place]) -> type[SectionedGroup]:
    """Make the class of a group of commands, in this order."""

    class LateCommands(SectionedGroup):
        def __init__(self, **settings: Any) -> None:
            super().__init__(**settings)
            self.commands = {name: LateCommand(name, place) for name, place in places.items()}

        def make_context(self, info_name: str | None, args: list[str], *given: Any, **named: Any) -> Any:
            with told_in_full([] if named.get("resilient_parsing") else args):
                return super().make_context(info_name, args, *given, **named)

    return LateCommands


SIMULATION_MB, BENCH_MB = 1000, 2000
"""Address space of commands that simulate or analyse (measured: 775), and that open a bench (1807) [MB]."""
COMMANDS = {
    "demo": Place(
        "demo",
        "demo",
        "Run the paper's experiment on the virtual rig: measure, analyse, simulate, and write a report.",
        Panel.MEASURE,
        ("bench", "figures"),
        space_mb=BENCH_MB,
    ),
    "measure": Place(
        "measure",
        "measure",
        "Measure: check the bench, ramp up, record and ramp down, for each measurement of a campaign.",
        Panel.MEASURE,
        space_mb=BENCH_MB,
    ),
    "watch": Place(
        "watch",
        "watch",
        "Watch what an engine carries out, from any terminal of the same user; Ctrl-C leaves it be.",
        Panel.MEASURE,
    ),
    "twin": Place(
        "twin",
        "twin",
        "Follow the hidden motion of what an engine measures, and note when the specimen changes.",
        Panel.MEASURE,
        space_mb=SIMULATION_MB,
    ),
    "stop": Place(
        "watch",
        "stop",
        "Stop all that engines, scripts and checks drive on this computer, campaigns and all.",
        Panel.MEASURE,
        advice=f"{SWITCH_OFF}.",
    ),
    "release": Place(
        "watch",
        "release",
        "Continue a run that was held with vibench stop --level hold, or in the window.",
        Panel.MEASURE,
    ),
    "gui": Place(
        "gui",
        "gui",
        "Open the window: connect, check, choose, preview, run, watch, compare.",
        Panel.MEASURE,
        ("gui",),
        space_mb=BENCH_MB,
    ),
    "analyse": Place(
        "analyse",
        "analyse",
        "Analyse recordings, complete, interrupted or still growing, and write one HTML report.",
        Panel.ANALYSE,
        ("figures",),
        space_mb=SIMULATION_MB,
    ),
    "catalogue": Place(
        "catalogue",
        "show_catalogue",
        "List the recordings of a folder and the folders in it: what, when, how they ended, how large.",
        Panel.ANALYSE,
    ),
    "figure": Place(
        "figure",
        "figure",
        "Draw a figure of the paper; studies are kept in DIR/studies and go on where they were stopped.",
        Panel.ANALYSE,
        ("figures",),
        space_mb=SIMULATION_MB,
    ),
    "reproduce": Place(
        "reproduce",
        "reproduce",
        "Measure what of the paper holds. Studies are kept in DIR/studies and go on where they were stopped.",
        Panel.ANALYSE,
        ("figures",),
        space_mb=SIMULATION_MB,
    ),
    "specimen": Place(
        "specimen",
        "show_specimen",
        "List the specimens and contact laws that there are, or say what one specimen amounts to.",
        Panel.PREDICT,
    ),
    "predict": Place(
        "predict",
        "predict",
        "Predict the responses of m0 and of p over frequency.",
        Panel.PREDICT,
        space_mb=SIMULATION_MB,
    ),
    "branches": Place(
        "branches",
        "branches",
        "Find and follow periodic motions over frequency or level, stable and unstable; name bifurcations.",
        Panel.PREDICT,
        ("figures",),
        space_mb=SIMULATION_MB,
    ),
    "spectrum": Place(
        "spectrum",
        "spectrum",
        "Compute all Lyapunov exponents over frequency or level, their sum, and the Kaplan-Yorke dimension.",
        Panel.PREDICT,
        ("figures",),
        space_mb=SIMULATION_MB,
    ),
    "chain": Place(
        "chain",
        "chain",
        "Follow cells in a row: bands and gaps, transmission, energy, impacts and exponents, cell by cell.",
        Panel.PREDICT,
        ("figures",),
        space_mb=SIMULATION_MB,
    ),
    "study": Place(
        "study",
        "study",
        "Predict responses for every combination listed in a file, longest first.",
        Panel.PREDICT,
        space_mb=SIMULATION_MB,
    ),
    "map": Place(
        "map_motions",
        "map_motions",
        "Map the motions over two parameters or two coordinates of the start, or along one parameter.",
        Panel.PREDICT,
        ("figures",),
        space_mb=SIMULATION_MB,
    ),
    "tradeoff": Place(
        "tradeoff",
        "tradeoff",
        "Measure what each accuracy costs and what error it makes, with and without impacts and in chaos.",
        Panel.PREDICT,
        ("figures",),
        space_mb=SIMULATION_MB,
    ),
    "bench": Place(
        "bench",
        "bench",
        "Check and list instruments.",
        Panel.BENCH,
        space_mb=BENCH_MB,
    ),
    "serve-rig": Place(
        "serve_rig",
        "serve_rig",
        "Serve the virtual rig to any pyvisa and nidaqmx program until Ctrl-C.",
        Panel.BENCH,
        ("bench",),
        space_mb=BENCH_MB,
    ),
    "export": Place(
        "export",
        "export",
        "Write a recording's samples or spectra, with units, as a file that other programs read.",
        Panel.FILES,
    ),
    "import": Place(
        "import_recording",
        "import_file",
        "Convert another program's file to a recording, or list its contents.",
        Panel.FILES,
    ),
    "pack": Place(
        "pack",
        "pack",
        "Pack a folder of recordings as a Research Object Crate, described for a repository.",
        Panel.FILES,
    ),
    "recover": Place(
        "recover",
        "recover_recording",
        "Finish a recording that was cut off: all that was committed becomes NAME.h5.",
        Panel.FILES,
    ),
    "verify": Place(
        "verify",
        "verify",
        "Hold every recording of a folder against its seal, samples and all, and against journals.",
        Panel.FILES,
    ),
    "examples": Place(
        "examples",
        "examples",
        "List the campaigns, rigs, studies and scripts that come with vibench, or copy them to change them.",
        Panel.INSTALLATION,
    ),
    "docs": Place(
        "docs",
        "docs",
        "Build the documentation site of this version unless it exists; print the path of its first page.",
        Panel.INSTALLATION,
    ),
    "schema": Place(
        "schema",
        "schema",
        "Print the JSON Schema (draft 4) of a kind of TOML file, for an editor that checks as one types.",
        Panel.INSTALLATION,
    ),
    "warm": Place(
        "warm",
        "warm",
        "Say that nothing needs compiling: the simulation was compiled when vibench was built.",
        Panel.INSTALLATION,
    ),
    "doctor": Place(
        "doctor",
        "doctor",
        "Say what this installation consists of, for a question to others: data only, nothing is changed.",
        Panel.INSTALLATION,
    ),
}

app = typer.Typer(
    name="vibench",
    help="Vibro-impact shaker experiments: run them, record them, and say what they mean.",
    cls=late_commands(COMMANDS),
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def tell_version(*, asked: bool) -> None:
    """Print the version, as ``--version`` alone asks for it."""
    if asked:
        from importlib.metadata import version

        typer.echo(f"vibench {version('vibench')}")
        raise typer.Exit


class LogLevel(StrEnum):
    """How much of what happens is written on standard error."""

    WARNING = "warning"
    INFO = "info"
    """What is noted in recordings, too."""
    DEBUG = "debug"
    """What instruments are told and answer, too."""


class OneLine(logging.Formatter):
    """What is logged may hold names and the words of instruments."""

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802 - the library's name
        """Write a message as one line."""
        return printable(super().formatMessage(record))


class LogBeside(logging.StreamHandler[TextIO]):
    """Writes beside whoever logs: a terminal that is held up, a pipe that nobody reads, hold up no run."""

    def __init__(self) -> None:
        super().__init__()
        self._beside = Beside("log")

    def emit(self, record: logging.LogRecord) -> None:
        """Let a line be written."""
        self._beside.do(lambda: super(LogBeside, self).emit(record))

    def close(self) -> None:
        """Leave the last lines a second."""
        self._beside.wait(1.0)
        super().close()


@app.callback()
def vibench(
    log_level: Annotated[
        LogLevel,
        typer.Option(
            help="Tell on standard error: info, what is noted in recordings; debug, every message to an "
            "instrument as well."
        ),
    ] = LogLevel.WARNING,
    _version: Annotated[
        bool,
        typer.Option(
            "--version",
            is_eager=True,
            callback=lambda asked: tell_version(asked=asked),
            help="Print the version.",
        ),
    ] = False,
) -> None:
    """Hold the commands."""
    handler = LogBeside()
    handler.setFormatter(OneLine("%(asctime)s %(name)s: %(message)s"))
    # Ours alone: other libraries log what a broken message of a client did to them, with a traceback.
    ours = logging.getLogger("vibench")
    ours.handlers = [handler]
    ours.setLevel(log_level.upper())


def main() -> None:
    """Run the command line. An error that a user can fix is one sentence and a non-zero exit."""
    os.environ.setdefault("GRPC_VERBOSITY", "ERROR")  # read when imported; a killed call is noted otherwise
    warnings.formatwarning = lambda message, *_place, **_named: f"warning: {message}\n"
    try:
        app()
    except CheckStopped as error:
        complain(error)
        sys.exit(ExitCode.STOPPED)
    except (AcquisitionError, AnalysisError, StudyError, UnreadableTomlError) as error:
        complain(error)
        sys.exit(ExitCode.FAILED)
    except UnicodeEncodeError as error:  # of a path: files hold text
        name = str(error.object).encode(errors="backslashreplace").decode()
        name = shortened(name, NAME_SHOWN)
        complain(OSError(f"{name} holds bytes that are no text; rename the file or folder"))
        sys.exit(ExitCode.FAILED)
    except (OSError, MemoryError, ImportError, RuntimeError, SystemError) as error:
        # Whoever looks at a path first meets it: here is the one place that all paths have behind them.
        sentence = _shortage(error) or _disk_trouble(error)
        if not sentence:
            raise
        complain(OSError(sentence))
        sys.exit(ExitCode.FAILED)


def _disk_trouble(error: Exception) -> str:
    if not isinstance(error, OSError) or error.errno not in DISK_ERRORS:
        return ""
    return DISK_ERRORS[error.errno].format(name=shortened(str(error.filename or "a file"), NAME_SHOWN))


def _shortage(error: BaseException | None) -> str:
    """Say which limit is behind an error, which libraries may have wrapped; empty if none is."""
    if error is None:
        return ""
    text = str(error)
    if isinstance(error, MemoryError) or any(said in text for said in _NO_MEMORY):
        return (
            "this process is out of memory; data written so far are kept. Close other "
            "programs, or raise its limit (ulimit -v)"
        )
    if isinstance(error, OSError | ImportError) and os.strerror(errno.EMFILE) in text:
        return (
            "this process cannot open more files; data written so far are kept. Raise its limit (ulimit "
            "-n), or close other programs"
        )
    return _shortage(error.__cause__ or error.__context__)


_PLACE = "{name} may not be written or read here; what was written before is kept. Give another place"
_ROOM = "there is no room for {name}; what was written before is kept. Make room, or give another place"
DISK_ERRORS = {
    errno.ENAMETOOLONG: "the name {name} is too long for this disk; nothing was done, give a shorter one",
    **dict.fromkeys((errno.EACCES, errno.EPERM, errno.EROFS), _PLACE),
    **dict.fromkeys((errno.ENOSPC, errno.EDQUOT, errno.EFBIG), _ROOM),
}
"""What a person can do something about."""
_NO_MEMORY = (
    os.strerror(errno.ENOMEM),
    "can't start new thread",
    "failed to map segment from shared object",
    "without setting an exception",
    "without exception set",
)
"""What the system, Python and the loader of libraries say where memory has run out."""


LONGEST_SENTENCE = 1800
"""Letters: whatever a file holds may stand in a sentence about it."""
NAME_SHOWN = 80
"""Letters of a name that is too long."""


def complain(error: BaseException) -> None:
    """Show an error on standard error: its sentence, then what else went wrong on the way out."""
    errors.print(Text("error:", style="bold red"), shortened(str(error), LONGEST_SENTENCE))
    for note in getattr(error, "__notes__", ()):
        errors.print(f"  {note}")


if __name__ == "__main__":
    main()
