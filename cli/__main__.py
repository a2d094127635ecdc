"""The `vibench` command: its list of commands, and the one place where an error becomes a sentence."""

import sys

from . import blas_threads  # noqa: F401 - numpy reads its setting, so it comes first

# isort: split
import typer
from rich.console import Console

from acquisition.errors import AcquisitionError
from analysis.errors import AnalysisError
from sim.study.errors import StudyError

from .analyse import analyse
from .bench import bench
from .catalogue import show_catalogue
from .demo import demo
from .export import export
from .figure import figure
from .gui import gui
from .import_recording import import_file
from .measure import measure
from .predict import predict
from .recover import recover_recording
from .reproduce import reproduce
from .serve_rig import serve_rig
from .study import study
from .tradeoff import tradeoff
from .watch import stop, watch

app = typer.Typer(
    name="vibench",
    help="Vibro-impact shaker experiments: run them, record them, and say what they mean.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.command()(demo)
app.command()(measure)
app.command()(watch)
app.command()(stop)
app.command()(analyse)
app.command(name="catalogue")(show_catalogue)
app.command()(predict)
app.command()(study)
app.command()(figure)
app.command()(gui)
app.command()(reproduce)
app.command()(tradeoff)
app.command()(export)
app.command(name="import")(import_file)
app.command(name="recover")(recover_recording)
app.command(name="serve-rig")(serve_rig)
app.add_typer(bench, name="bench")


def main() -> None:
    """Run the command line. An error that a user can mend is one sentence and a non-zero exit."""
    try:
        app()
    except (AcquisitionError, AnalysisError, StudyError) as error:
        complain(error)
        sys.exit(1)


def complain(error: BaseException) -> None:
    """Show an error on standard error: its sentence, then what else went wrong on the way out."""
    console = Console(stderr=True, highlight=False, soft_wrap=True)
    console.print(f"[bold red]error:[/] {_plain(str(error))}")
    for note in getattr(error, "__notes__", ()):
        console.print(f"  {_plain(note)}")


def _plain(text: str) -> str:
    return text.replace("[", r"\[")


if __name__ == "__main__":
    main()
