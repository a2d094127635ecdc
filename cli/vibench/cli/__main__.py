"""The `vibench` command: the table of commands, and how their errors are reported.

Listing the commands imports no command; each command is imported when it is called.
"""

import errno
import importlib
import logging
import os
import shutil
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, TextIO

import typer
from rich.text import Text
from typer.core import TyperCommand

from vibench.acquisition import (
    AcquisitionError,
    Beside,
    CheckStopped,
    printable,
    require_extra,
    require_space,
    shorten,
)
from vibench.analysis import AnalysisError
from vibench.sim import UnreadableTomlError
from vibench.sim.study import StudyError
from vibench.stop_files import SWITCH_OFF

from . import environment  # noqa: F401 - numpy reads its setting, so it comes first
from .options import SectionedCommand, SectionedGroup, with_options, words_of
from .output import ExitCode, errors


class Panel(StrEnum):
    """Headings under which `vibench --help` lists the commands."""

    MEASURE = "Measure"
    ANALYSE = "Analyse"
    PREDICT = "Predict"
    BENCH = "Bench"
    FILES = "Files"
    INSTALLATION = "Installation"


@dataclass(frozen=True)
class Place:
    """Place where a command is defined, and the command's requirements."""

    panel: Panel
    function: str
    extras: tuple[str, ...] = ()
    """Optional dependencies that the command needs; list each extra before the extras that it includes."""
    space_mb: int = 300
    """Address space that the libraries and threads of the command need [MB]."""
    advice: str = ""
    """Advice to the user if the command cannot run."""
    help: str = ""
    """Help text of a group of commands; a single command uses the docstring of its function."""

    def load(self) -> typer.Typer:
        """Import the command, and return an application with this one command."""
        module, name = self.function.split(":")
        found = getattr(importlib.import_module(f".{module}", __package__), name)
        if isinstance(found, typer.Typer):
            return found
        application = typer.Typer(add_completion=False, rich_markup_mode=None)
        application.command(cls=SectionedCommand)(with_options(found))
        return application

    @property
    def summary(self) -> str:
        """First line of the function's docstring, read from the source code because importing is slow."""
        module, name = self.function.split(":")
        source = Path(__file__).with_name(f"{module}.py").read_text(encoding="utf-8")
        docstring = source.partition(f"\ndef {name}(")[2].partition('"""')[2]
        return self.help or docstring.partition("\n")[0].removesuffix('"""')


class LateCommand(TyperCommand):
    """Placeholder in the list of commands; the command is imported when it is called."""

    def __init__(self, name: str, place: Place) -> None:
        super().__init__(name, rich_help_panel=place.panel)
        self._place = place

    def get_short_help_str(self, limit: int = 45) -> str:  # noqa: ARG002 - the line is not shortened
        """Return the line that describes this command in the list of commands."""
        return self._place.summary

    def make_context(self, info_name: str | None, args: list[str], *given: Any, **named: Any) -> Any:
        """Parse the arguments with the real command."""
        if not named.get("resilient_parsing"):
            require_space(self._place.space_mb, self._place.advice)
        command = typer.main.get_command(self._place.load())
        command.name = self.name
        with explain_refusals([] if named.get("resilient_parsing") else args):
            context = command.make_context(info_name, [*args], *given, **named)
        if not named.get("resilient_parsing"):
            for extra in self._place.extras:
                require_extra(extra)
        return context


_USAGE_ERROR: Any = typer.BadParameter.__mro__[1]
"""Base class of usage errors, from click or from the copy of click in newer versions of typer."""


@contextmanager
def explain_refusals(args: Sequence[str]) -> Iterator[None]:
    """Refuse empty arguments inside this context, and state given and allowed values in usage errors."""
    words = ["", *words_of(args)]
    empty = next((before for before, word in pairwise(words) if not word), None)
    try:
        if empty is not None:
            place = empty if empty.startswith("--") else "an argument"
            raise typer.BadParameter(
                f"{place} was given as '', which is empty; give a value, or leave it out. A common cause is "
                "an unset shell variable."
            )
        yield
    except _USAGE_ERROR as error:
        if isinstance(error, typer.BadParameter):
            _add_given_value(error, words)
        if type(error) is typer.BadParameter:  # subclasses, such as a missing option, keep code 2
            error.exit_code = ExitCode.FAILED
        if "extra argument" in error.message:
            error.message += "; give one path, such as a folder, and put a path with spaces in quotes"
        if args:  # without arguments, the error's message is the help text
            error.message = printable(error.message)
        raise


def _add_given_value(error: typer.BadParameter, words: Sequence[str]) -> None:
    error.message = error.message.removeprefix("Value error, ")
    names = () if error.param is None else error.param.opts
    given = next((word for before, word in pairwise(words) if before in names), None)
    if given is None:
        return
    if any(kind in error.message for kind in ("number", "float", "integer")) and not _is_number(given):
        advice = "number; give a number in SI units without the unit, such as 5 or 5e-6"
        advice = "whole number; give a number such as 5" if "integer" in error.message else advice
        error.message = f"{given!r} is not a {advice}."
    elif error.message.startswith("Input should be "):
        error.message = f"{given!r} was given; it {error.message.removeprefix('Input ').partition(', ')[0]}."


def _is_number(text: str) -> bool:
    from vibench.sim import number_of

    try:
        number_of(text)
    except ValueError:
        return False
    return True


class LateCommands(SectionedGroup):
    """The group of all commands, in the order of `COMMANDS`."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        self.commands = {name: LateCommand(name, place) for name, place in COMMANDS.items()}

    def make_context(self, info_name: str | None, args: list[str], *given: Any, **named: Any) -> Any:
        """Parse the arguments before the command's name."""
        with explain_refusals([] if named.get("resilient_parsing") else args):
            return super().make_context(info_name, args, *given, **named)


SIMULATION_MB, BENCH_MB = 1000, 2000
"""Address space [MB] of commands that simulate or analyse (measured: 775), or that open a bench (1807)."""
COMMANDS = {
    "demo": Place(Panel.MEASURE, "demo:demo", ("bench", "figures"), space_mb=BENCH_MB),
    "measure": Place(Panel.MEASURE, "measure:measure", space_mb=BENCH_MB),
    "watch": Place(Panel.MEASURE, "watch:watch"),
    "twin": Place(Panel.MEASURE, "twin:twin", space_mb=SIMULATION_MB),
    "stop": Place(Panel.MEASURE, "watch:stop", advice=f"{SWITCH_OFF}."),
    "release": Place(Panel.MEASURE, "watch:release"),
    "gui": Place(Panel.MEASURE, "watch:gui", ("gui",), space_mb=BENCH_MB),
    "analyse": Place(Panel.ANALYSE, "analyse:analyse", ("figures",), space_mb=SIMULATION_MB),
    "catalogue": Place(Panel.ANALYSE, "files:show_catalogue"),
    "figure": Place(Panel.ANALYSE, "reproduce:figure", ("figures",), space_mb=SIMULATION_MB),
    "reproduce": Place(Panel.ANALYSE, "reproduce:reproduce", ("figures",), space_mb=SIMULATION_MB),
    "specimen": Place(Panel.PREDICT, "specimen:show_specimen"),
    "predict": Place(Panel.PREDICT, "predict:predict", space_mb=SIMULATION_MB),
    "branches": Place(Panel.PREDICT, "dynamics:branches", ("figures",), space_mb=SIMULATION_MB),
    "spectrum": Place(Panel.PREDICT, "dynamics:spectrum", ("figures",), space_mb=SIMULATION_MB),
    "chain": Place(Panel.PREDICT, "dynamics:chain", ("figures",), space_mb=SIMULATION_MB),
    "study": Place(Panel.PREDICT, "predict:study", space_mb=SIMULATION_MB),
    "map": Place(Panel.PREDICT, "map_motions:map_motions", ("figures",), space_mb=SIMULATION_MB),
    "tradeoff": Place(Panel.PREDICT, "predict:tradeoff", ("figures",), space_mb=SIMULATION_MB),
    "bench": Place(Panel.BENCH, "bench:bench", space_mb=BENCH_MB, help="Check and list instruments."),
    "serve-rig": Place(Panel.BENCH, "serve_rig:serve_rig", ("bench",), space_mb=BENCH_MB),
    "export": Place(Panel.FILES, "files:export"),
    "import": Place(Panel.FILES, "files:import_file"),
    "pack": Place(Panel.FILES, "files:pack"),
    "recover": Place(Panel.FILES, "recover:recover_recording"),
    "verify": Place(Panel.FILES, "files:verify"),
    "examples": Place(Panel.INSTALLATION, "installation:examples"),
    "docs": Place(Panel.INSTALLATION, "installation:docs"),
    "schema": Place(Panel.INSTALLATION, "installation:schema"),
    "warm": Place(Panel.INSTALLATION, "installation:warm"),
    "doctor": Place(Panel.INSTALLATION, "doctor:doctor"),
}

app = typer.Typer(
    name="vibench",
    help="Vibro-impact shaker experiments: measure, analyse and predict.",
    cls=LateCommands,
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def print_version(is_requested: bool) -> None:
    """Print the version if ``--version`` was given."""
    if is_requested:
        from importlib.metadata import version

        typer.echo(f"vibench {version('vibench')}")
        raise typer.Exit


class LogLevel(StrEnum):
    """How many log messages are written to standard error."""

    WARNING = "warning"
    INFO = "info"
    """Also log the messages that are stored in recordings."""
    DEBUG = "debug"
    """Also log every message to an instrument, with the instrument's reply."""


class OneLine(logging.Formatter):
    """Formatter that writes a log message on one line, without control characters from names or replies."""

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802 - the library's name
        """Return a log message as one line."""
        return printable(super().formatMessage(record))


class LogBeside(logging.StreamHandler[TextIO]):
    """Handler that logs in a separate thread, so that a blocked terminal or pipe does not delay a run."""

    def __init__(self) -> None:
        super().__init__()
        self._beside = Beside("log")

    def emit(self, record: logging.LogRecord) -> None:
        """Queue a log message, which another thread writes."""
        self._beside.do(lambda: super(LogBeside, self).emit(record))

    def close(self) -> None:
        """Wait at most 1 s for the remaining messages to be written, then close the log."""
        self._beside.wait(1.0)
        super().close()


@app.callback()
def vibench(
    log_level: Annotated[
        LogLevel,
        typer.Option(
            help="Level of the log on standard error. info: also notes of recordings; debug: also every "
            "message to an instrument."
        ),
    ] = LogLevel.WARNING,
    _version: Annotated[
        bool,
        typer.Option(
            "--version",
            is_eager=True,
            callback=print_version,
            help="Print the version.",
        ),
    ] = False,
) -> None:
    """Set up logging for all commands."""
    handler = LogBeside()
    handler.setFormatter(OneLine("%(asctime)s %(name)s: %(message)s"))
    # Log only vibench: for every broken message of a client, other libraries would log a traceback.
    ours = logging.getLogger("vibench")
    ours.handlers = [handler]
    ours.setLevel(log_level.upper())


def warning_line(message: Warning | str) -> str:
    """Return a warning as one line; describe numpy's warnings in the user's terms."""
    if isinstance(message, RuntimeWarning):
        message = f"some numbers are too large or too small to compute with ({message}); check their units"
    return f"warning: {printable(str(message))}\n"


def main() -> None:
    """Run the command line; on an error that the user can fix, print one sentence and exit with 1 or 3."""
    os.environ.setdefault("GRPC_VERBOSITY", "ERROR")  # this hides gRPC's log of ended calls
    warnings.formatwarning = lambda message, *_place, **_named: warning_line(message)
    try:
        app()
    except CheckStopped as error:
        complain(error)
        sys.exit(ExitCode.STOPPED)
    except (AcquisitionError, AnalysisError, StudyError, UnreadableTomlError) as error:
        complain(error)
        sys.exit(ExitCode.FAILED)
    except UnicodeEncodeError as error:  # only a path can contain invalid text
        name = str(error.object).encode(errors="backslashreplace").decode()
        complain(OSError(f"{name} contains bytes that are not text; rename the file or folder"))
        sys.exit(ExitCode.FAILED)
    except (OSError, MemoryError, ImportError, RuntimeError, SystemError) as error:
        # Any command may be given an unusable path, so errors of paths are handled here for all commands.
        sentence = _shortage(error) or _disk_trouble(error)
        if not sentence:
            raise
        complain(OSError(sentence))
        sys.exit(ExitCode.FAILED)


def _disk_trouble(error: Exception) -> str:
    if isinstance(error, shutil.Error):  # it contains only the texts of the errors of all copied files
        _, target, text = error.args[0][0]
        error = OSError(next((n for n in DISK_ERRORS if f"[Errno {n}]" in text), 0), text, target)
    if not isinstance(error, OSError) or error.errno not in DISK_ERRORS:
        return ""
    name = str(error.filename2 or error.filename or "a file")  # filename2 is the target of a failed copy
    return DISK_ERRORS[error.errno].format(name=shorten(name, NAME_SHOWN))


def _shortage(error: BaseException | None) -> str:
    """Return a message if the program has run out of memory or open files, which can cause other errors."""
    if error is None:
        return ""
    text = str(error)
    if isinstance(error, MemoryError) or any(phrase in text for phrase in _NO_MEMORY):
        return (
            "this process is out of memory; data written so far are kept. Close other "
            "programs, or raise the memory limit (ulimit -v)"
        )
    if isinstance(error, OSError | ImportError) and os.strerror(errno.EMFILE) in text:
        return (
            "this process cannot open more files; data written so far are kept. Raise the limit of open "
            "files (ulimit -n), or close other programs"
        )
    return _shortage(error.__cause__ or error.__context__)


_PLACE = "{name} cannot be written or read; data written so far are kept. Give another path"
_ROOM = "there is no space for {name}; data written so far are kept. Make room, or give another path"
DISK_ERRORS = {
    errno.ENAMETOOLONG: "the name {name} is too long for this disk; nothing was done. Give a shorter name",
    **dict.fromkeys((errno.EACCES, errno.EPERM, errno.EROFS), _PLACE),
    **dict.fromkeys((errno.ENOSPC, errno.EDQUOT, errno.EFBIG), _ROOM),
}
"""Messages to the user about disk errors that the user can fix, keyed by the error number."""
_NO_MEMORY = (
    os.strerror(errno.ENOMEM),
    "can't start new thread",
    "failed to map segment from shared object",
    "without setting an exception",
    "without exception set",
)
"""Error messages by which the system, Python and the loader report that memory has run out."""


NAME_SHOWN = 80
"""Number of characters shown of a file name that is too long."""


def complain(error: BaseException) -> None:
    """Print the message of an error, then the messages of the errors that followed it."""
    errors.print(Text("error:", style="bold red"), str(error))
    for note in getattr(error, "__notes__", ()):
        errors.print(f"  {note}")


if __name__ == "__main__":
    main()
