"""`vibench reproduce`: test every measurable claim of the paper."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.table import Table

from vibench.analysis.report import ImageKind
from vibench.sim import Accuracy
from vibench.sim.operating_system.this import replace_file

from .options import option
from .output import bold, console, leave_output_to_json, print_json, print_table
from .paper.case import OPTIONS, case_with
from .paper.options import FigureOptions, FrequencyGrid
from .paths import AsJson, room_for_folder, room_for_page
from .points import Workers
from .study import KeptStudies

if TYPE_CHECKING:
    from .paper.page import Reproduction

PAGE = "reproduction.md"
_FORMS = ", ".join(f"{name}={option.example} ({option.about})" for name, option in OPTIONS.items())
IMAGES = "images"


def reproduce(
    out: Annotated[Path, option("Folder for the page and its studies.", "DIR")],
    markdown: Annotated[Path | None, option("File of the page; by default in DIR.", "FILE.md")] = None,
    damping_time: Annotated[float, option("Time in c_i = time * k_i.", "S")] = FigureOptions.damping_time_s,
    accuracy: Annotated[Accuracy, option("Accuracy of every point.")] = Accuracy.QUICK,
    grid: Annotated[FrequencyGrid, option("Points every 5 Hz (coarse) or 1 Hz (fine).")] = FigureOptions.grid,
    choices: Annotated[
        list[str] | None,
        option(f"Choices that the paper leaves open: {_FORMS}.", "NAME=VALUE", name="--with"),
    ] = None,
    workers: Workers = None,
    as_json: AsJson = False,
) -> None:
    """Test the claims of the paper; a repeated command continues the studies stored in DIR/studies."""
    from vibench.analysis.report import write_page

    from .paper.claims import SECTIONS
    from .paper.figure_03_levels import draw as draw_levels
    from .paper.page import reproduction, reproduction_document, reproduction_page
    from .paper.reading import Evidence, Reading
    from .paper.settings import score_figure

    if as_json:
        leave_output_to_json()
    options = FigureOptions(damping_time_s=damping_time, accuracy=accuracy, grid=grid)
    case = case_with(options, choices or ())
    room_for_folder(out)
    page = out / PAGE if markdown is None else markdown
    room_for_page(page)
    studies = KeptStudies(out / "studies", workers)
    evidence = Evidence(studies)
    found = reproduction(SECTIONS, evidence, case, lambda step: console.print(f"measuring {step}"))
    page.parent.mkdir(parents=True, exist_ok=True)
    score = score_figure(found.scores)
    levels = draw_levels(case, evidence.study(Reading(evidence, case).levels()))
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
