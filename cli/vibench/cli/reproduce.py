"""`vibench figure` and `vibench reproduce`: draw the figures of the paper, and test its claims."""

import hashlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from vibench.acquisition import ConfigurationError
from vibench.analysis import InvalidRequest
from vibench.analysis.report import ImageKind
from vibench.sim import Accuracy
from vibench.sim.operating_system.this import replace_file
from vibench.sim.study import ExistingStudy, Study, StudyResults, solve_study

from .options import option
from .output import (
    ExitCode,
    bold,
    console,
    errors,
    print_json,
    print_table,
    print_warnings,
)
from .paper.options import OPTIONS, Case, FrequencyGrid, case_with
from .paths import AsJson, room_for_folder
from .progress_bars import study_bar, watch_interrupt
from .scene_options import Workers, print_failures

if TYPE_CHECKING:
    from vibench.analysis import CampaignResults
    from vibench.analysis.report import DrawnFigure

    from .paper.page import Reproduction


_DIGEST = 16


class KeptStudies:
    """Solver that stores each study's results in a folder, in a file named by a hash of the study."""

    def __init__(self, folder: Path, workers: int | None) -> None:
        self._folder = folder
        self._workers = workers
        self._failed = 0

    def __call__(self, study: Study) -> StudyResults:
        """Solve the points that are missing in a study's file; return the results of all points."""
        self._folder.mkdir(parents=True, exist_ok=True)
        digest = hashlib.sha256(study.model_dump_json().encode()).hexdigest()[:_DIGEST]
        with watch_interrupt() as is_stopped, study_bar(study.grid.size) as observer:
            results = solve_study(
                study,
                self._folder / f"{digest}.h5",
                ExistingStudy.RESUME,
                self._workers,
                observer=observer,
                cancelled=is_stopped,
            )
        self._failed += print_failures(study, list(results.failures()))
        if not results.is_complete:
            errors.print(
                f"stopped after {results.done} of {study.grid.size} points; repeat the command to continue"
            )
            raise typer.Exit(ExitCode.STOPPED)
        return results

    def complain(self) -> None:
        """Exit with an error code if a point of any study has failed; all other points stay stored."""
        if self._failed > 0:
            raise typer.Exit(ExitCode.FAILED)


ALL = "all"
EXPERIMENT = (12, 13, 14)
"""Numbers of the paper's figures that show measurements; these figures are drawn from recordings."""


def figure(
    number: Annotated[str, typer.Argument(metavar="N", help="1 to 14, or all.")],
    out: Annotated[Path, option("Folder for the figures.", "DIR")],
    recordings: Annotated[
        Path | None, option("Recordings for figures 12 to 14; see vibench demo.", "DIR")
    ] = None,
    damping_time: Annotated[float, option("Time in c_i = time * k_i.", "S")] = Case.damping_time_s,
    gap: Annotated[float, option("Clearance at both stops.", "M")] = Case.gap_m,
    accuracy: Annotated[Accuracy, option("Accuracy of every point.")] = Case.accuracy,
    grid: Annotated[FrequencyGrid, option("Points every 5 Hz (coarse) or 1 Hz (fine).")] = Case.grid,
    workers: Workers = None,
    kinds: Annotated[list[ImageKind], option("Image format; may be repeated.", name="--format")] = [  # noqa: B006 - typer copies it
        ImageKind.PNG,
        ImageKind.SVG,
    ],
    as_json: AsJson = False,
) -> None:
    """Draw a figure of the paper; a repeated command continues the studies stored in DIR/studies."""
    from .paper.figures import FIGURES

    options = Case(damping_time_s=damping_time, gap_m=gap, accuracy=accuracy, grid=grid)
    numbers = _numbers(number, tuple(FIGURES))
    # Before drawing the first figure, check the inputs of all figures.
    figure_studies = {each: FIGURES[each].studies(options) for each in numbers if each in FIGURES}
    room_for_folder(out)
    experiment = _experiment(recordings, [each for each in numbers if each in EXPERIMENT])
    studies = KeptStudies(out / "studies", workers)

    def draw_simulated(each: int) -> "Iterator[DrawnFigure]":
        yield FIGURES[each].draw(options, *(studies(one) for one in figure_studies[each]))

    written: list[dict[str, object]] = []
    for each in numbers:
        for one in experiment(each) if each in EXPERIMENT else draw_simulated(each):
            paths = one.save(out, kinds)
            console.print(f"figure {each}:", bold(paths[0]), f"({one.title})")
            written.append({"figure": each, "title": one.title, "files": [str(path) for path in paths]})
    if as_json:
        print_json({"figures": written})
    studies.complain()


def _numbers(text: str, simulated: tuple[int, ...]) -> tuple[int, ...]:
    known = (*simulated, *EXPERIMENT)
    if text == ALL:
        return simulated
    if text.isdigit() and int(text) in known:
        return (int(text),)
    raise InvalidRequest(f"figure {text!r} was given; give 1 to {known[-1]}, or all")


def _experiment(folder: Path | None, wanted: list[int]) -> "Callable[[int], Iterator[DrawnFigure]]":
    """Return the function that draws figures of measurements; the recordings are analysed only once."""
    if not wanted:
        return lambda _: iter(())
    if folder is None:
        raise InvalidRequest(
            f"figure {wanted[0]} shows the experiment; give its recordings with --recordings DIR, such as "
            "the folder of 'vibench demo'"
        )
    from vibench.analysis import analyse_files, recordings_in
    from vibench.analysis.report import check_warnings

    from .analyse import complain_about

    results = analyse_files(recordings_in(folder), folder.name)
    print_warnings(check_warnings(results))
    complain_about(results)
    return lambda number: _result_figures(number, results)


def _result_figures(number: int, results: "CampaignResults") -> "Iterator[DrawnFigure]":
    from vibench.analysis import CampaignResults
    from vibench.analysis.report import recording_figures, result_figures

    match number:
        case 12:
            for each in results.results[:1]:
                yield from recording_figures(each)
        case 13:
            chosen = CampaignResults(results.name, (*results.noise, *results.sweeps), ())
            yield from result_figures(chosen)
        case _:
            yield from result_figures(CampaignResults(results.name, results.dwells, ()))


PAGE = "reproduction.md"
_FORMS = ", ".join(f"{name}={choice.example} ({choice.about})" for name, choice in OPTIONS.items())
IMAGES = "images"


def reproduce(
    out: Annotated[Path, option("Folder for the page and its studies.", "DIR")],
    markdown: Annotated[Path | None, option("File of the page; by default in DIR.", "FILE.md")] = None,
    damping_time: Annotated[float, option("Time in c_i = time * k_i.", "S")] = Case.damping_time_s,
    accuracy: Annotated[Accuracy, option("Accuracy of every point.")] = Accuracy.QUICK,
    grid: Annotated[FrequencyGrid, option("Points every 5 Hz (coarse) or 1 Hz (fine).")] = Case.grid,
    choices: Annotated[
        list[str] | None,
        option(f"Choices that the paper leaves open: {_FORMS}.", "NAME=VALUE", name="--with"),
    ] = None,
    workers: Workers = None,
    as_json: AsJson = False,
) -> None:
    """Test the claims of the paper; a repeated command continues the studies stored in DIR/studies."""
    from vibench.analysis.report import write_page

    from .paper.figures import FIGURES
    from .paper.page import SECTIONS, reproduction, reproduction_document, reproduction_page
    from .paper.reading import Evidence, Reading
    from .paper.settings import score_figure

    options = Case(damping_time_s=damping_time, accuracy=accuracy, grid=grid)
    case = case_with(options, choices or ())
    room_for_folder(out)
    page = out / PAGE if markdown is None else markdown
    if page.is_dir():
        raise ConfigurationError(f"{page} is a folder. Nothing was computed; give the name of a file in it")
    room_for_folder(page.parent)
    studies = KeptStudies(out / "studies", workers)
    evidence = Evidence(studies)
    found = reproduction(SECTIONS, evidence, case, lambda step: console.print(f"measuring {step}"))
    page.parent.mkdir(parents=True, exist_ok=True)
    score = score_figure(found.scores)
    levels = FIGURES[3].draw(case, evidence.study(Reading(evidence, case).levels()))
    pictures = []
    for drawn in (score, levels):
        image = drawn.save(page.parent / IMAGES, (ImageKind.PNG,))[0]
        pictures.append((drawn.title, Path(os.path.relpath(image, page.parent)).as_posix()))
    with replace_file(page) as coming:
        coming.write_text(reproduction_document(found, pictures), encoding="utf-8")
    report = write_page(reproduction_page(found, levels, score), out / "report.html")
    _print_result(found)
    console.print("The page:", bold(page.resolve()))
    console.print("The report:", bold(report.resolve()))
    if as_json:
        claims = [{"claim": each.claim.says, "verdict": each.verdict.value} for each in found.judgements]
        print_json({"page": str(page), "report": str(report), "claims": claims})
    studies.complain()


def _print_result(found: "Reproduction") -> None:
    from .paper.page import verdict_text

    rows = Table(title="Claims that hold", title_justify="left")
    rows.add_column("claim")
    rows.add_column("verdict")
    for each in found.judgements:
        rows.add_row(each.claim.says, verdict_text(each))
    print_table(rows)
