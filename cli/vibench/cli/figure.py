"""`vibench figure`: draw a figure of the paper, from simulations or from recordings."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vibench.analysis import CampaignResults, InvalidRequest, analyse_files, recordings_in
from vibench.analysis.report import ImageKind
from vibench.sim import Accuracy

from .analyse import complain_about
from .options import option
from .output import bold, console, leave_output_to_json, print_json, print_warnings
from .paper.figures import FILES, paper_figure
from .paper.options import FigureOptions, FrequencyGrid
from .paths import AsJson, room_for_folder
from .points import Workers
from .study import KeptStudies

if TYPE_CHECKING:
    from vibench.analysis.report import DrawnFigure

ALL = "all"
EXPERIMENT = (12, 13, 14)
"""Numbers of the paper's figures that show measurements; these figures are drawn from recordings."""


def figure(
    number: Annotated[str, typer.Argument(metavar="N", help="1 to 14, or all.")],
    out: Annotated[Path, option("Folder for the figures.", "DIR")],
    recordings: Annotated[
        Path | None, option("Recordings for figures 12 to 14; see vibench demo.", "DIR")
    ] = None,
    damping_time: Annotated[float, option("Time in c_i = time * k_i.", "S")] = FigureOptions.damping_time_s,
    gap: Annotated[float, option("Clearance at both stops.", "M")] = FigureOptions.gap_m,
    accuracy: Annotated[Accuracy, option("Accuracy of every point.")] = FigureOptions.accuracy,
    grid: Annotated[FrequencyGrid, option("Points every 5 Hz (coarse) or 1 Hz (fine).")] = FigureOptions.grid,
    workers: Workers = None,
    kinds: Annotated[list[ImageKind], option("Image format; may be repeated.", name="--format")] = [  # noqa: B006 - typer copies it
        ImageKind.PNG,
        ImageKind.SVG,
    ],
    as_json: AsJson = False,
) -> None:
    """Draw a figure of the paper; a repeated command continues the studies stored in DIR/studies."""
    if as_json:
        leave_output_to_json()
    options = FigureOptions(damping_time_s=damping_time, gap_m=gap, accuracy=accuracy, grid=grid)
    numbers = _numbers(number)
    # Check the inputs of all figures before the first figure is drawn.
    figure_studies = {each: paper_figure(each).studies(options) for each in numbers if each in FILES}
    room_for_folder(out)
    experiment = _experiment(recordings, [each for each in numbers if each in EXPERIMENT])
    studies = KeptStudies(out / "studies", workers)

    def draw_simulated(each: int) -> "Iterator[DrawnFigure]":
        yield paper_figure(each).draw(options, *(studies(one) for one in figure_studies[each]))

    written: list[dict[str, object]] = []
    for each in numbers:
        for one in experiment(each) if each in EXPERIMENT else draw_simulated(each):
            paths = one.save(out, kinds)
            console.print(f"figure {each}:", bold(paths[0]), f"({one.title})")
            written.append({"figure": each, "title": one.title, "files": [str(path) for path in paths]})
    if as_json:
        print_json({"figures": written})
    studies.complain()


def _numbers(text: str) -> tuple[int, ...]:
    known = (*FILES, *EXPERIMENT)
    if text == ALL:
        return tuple(FILES)
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
    from vibench.analysis.report import check_warnings

    results = analyse_files(recordings_in(folder), folder.name)
    print_warnings(check_warnings(results))
    complain_about(results)
    return lambda number: _result_figures(number, results)


def _result_figures(number: int, results: CampaignResults) -> "Iterator[DrawnFigure]":
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
