"""Writing the report of a campaign, or of one recording, as one self-contained HTML file."""

import base64
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from vibench.acquisition import printable
from vibench.acquisition.plan import excitation_text
from vibench.sim.maps import MapResults

from ..dynamics import BranchDiagram
from ..errors import NotEnoughData
from ..figures import DrawnFigure, hidden_impacts_figure, hidden_motion_figure
from ..hidden_motion import HiddenMotion
from ..kinds import AnyResult
from ..recordings import Verdict
from ..results import AnalysisFailure, CampaignResults
from ._drawings import findings, recording_figures, result_figures, result_tables
from ._findings import limits
from ._laid_branches import laid_branches, laid_maps
from ._recording_section import (
    CHANNEL_HEADINGS,
    Rows,
    bench_rows,
    channel_rows,
    check_rows,
    measured_rows,
    version_rows,
)
from ._result_tables import ReportTable

_LARGEST_SVG_BYTES = 300_000
"""Above this a PNG is smaller and quicker to show, and as legible."""


@dataclass(frozen=True)
class EmbeddedFigure:
    """A figure as the page holds it."""

    number: int
    title: str
    caption: str
    source: str
    """A ``data:`` address with the whole image in it."""


@dataclass(frozen=True)
class RecordingSection:
    """What the page says of one recording."""

    name: str
    measured: Rows
    checks: tuple[tuple[str, str, str], ...]
    figures: tuple[EmbeddedFigure, ...]


@dataclass(frozen=True)
class BenchSection:
    """A bench, and the recordings that were made with it."""

    recordings: str
    rows: Rows
    channels: tuple[tuple[str, ...], ...]
    versions: Rows


def write_report(
    results: CampaignResults,
    path: Path,
    figures_folder: Path | None = None,
    diagrams: Sequence[BranchDiagram] = (),
    hidden: Sequence[HiddenMotion] = (),
    maps: Sequence[MapResults] = (),
) -> Path:
    """Write one HTML file with all figures inside; an older report of that name is replaced.

    Parameters
    ----------
    results
        What `analyse_files` gave, of a whole campaign or of one recording.
    path
        Of the HTML file; its folder is made.
    figures_folder
        Where PNG, SVG and CSV of each figure go beside it; None writes none.
    diagrams
        Branches that are laid over the stepped sines and sweeps.
    hidden
        Hidden motions; each stands with the recording whose name it has.
    maps
        Maps on which the levels of stepped sines and sweeps are laid.

    Raises
    ------
    NotEnoughData
        When there are neither results nor failures to report.

    """
    if not results.results and not results.failures:
        raise NotEnoughData(f"{results.name!r} has no recordings, so there is nothing to report")
    numbers = iter(range(1, 1000))
    found = [_embedded(next(numbers), each, figures_folder) for each in result_figures(results)]
    found += [_embedded(next(numbers), each, figures_folder) for each in laid_branches(results, diagrams)]
    found += [_embedded(next(numbers), each, figures_folder) for each in laid_maps(results, maps)]
    motions = {each.name: each for each in hidden}
    sections = [_section(each, motions, numbers, figures_folder) for each in results.results]
    page = _environment().get_template("report.html.j2")
    text = page.render(
        name=results.name,
        is_simulated=any(each.is_simulated for each in results.facts),
        is_real=any(not each.is_simulated for each in results.facts),
        written=datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        version=version("vibench"),
        overview=_overview(results),
        warnings=tuple(_warnings(results)),
        figures=found,
        tables=result_tables(results),
        sections=sections,
        benches=_benches(results),
        channel_headings=CHANNEL_HEADINGS,
        findings=tuple(findings(results)),
        limits=tuple(limits(results)),
        failures=results.failures,
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def _shown(content: object) -> object:
    """Write control characters of names and texts as escapes; Markup is of the template itself."""
    return printable(content) if type(content) is str else content


def _environment() -> Environment:
    return Environment(
        loader=PackageLoader("vibench.analysis.report", "."),
        autoescape=True,
        finalize=_shown,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def _embedded(number: int, drawn: DrawnFigure, folder: Path | None) -> EmbeddedFigure:
    if folder is not None:
        drawn.save(folder)
    svg = drawn.svg
    kind, content = ("svg+xml", svg) if len(svg) <= _LARGEST_SVG_BYTES else ("png", drawn.png)
    source = f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"
    return EmbeddedFigure(number, drawn.title, drawn.caption, source)


def _section(
    result: AnyResult, motions: Mapping[str, HiddenMotion], numbers: Iterator[int], folder: Path | None
) -> RecordingSection:
    facts = result.analysis.facts
    drawn = list(recording_figures(result))
    if facts.name in motions:
        drawn += [draw(motions[facts.name]) for draw in (hidden_motion_figure, hidden_impacts_figure)]
    return RecordingSection(
        name=facts.name,
        measured=measured_rows(facts),
        checks=check_rows(result.analysis.checks),
        figures=tuple(_embedded(next(numbers), each, folder) for each in drawn),
    )


def _overview(results: CampaignResults) -> ReportTable:
    rows = tuple(
        (
            facts.name,
            excitation_text(facts.measurement.excitation),
            facts.started_utc[:19].replace("T", " "),
            f"{facts.duration_s:.1f} s",
            facts.state.value,
            "simulated instruments" if facts.is_simulated else "real bench",
        )
        for facts in results.facts
    )
    headings = ("recording", "excitation", "started (UTC)", "length", "ended", "origin")
    return ReportTable("Recordings", headings, rows, "")


def _warnings(results: CampaignResults) -> Iterator[str]:
    for failure in results.failures:
        yield _sentence(failure)
    yield from check_warnings(results)


def check_warnings(results: CampaignResults) -> Iterator[str]:
    """Say what to look at before a result is trusted.

    Parameters
    ----------
    results
        As `vibench.analysis.analyse_files` gives them.

    Returns
    -------
    A sentence for each check of a recording that ended with a warning.

    """
    for result in results.results:
        for check in result.analysis.checks:
            if check.verdict is Verdict.WARNING:
                yield f"{result.analysis.facts.name}: {check.what.lower()}: {check.text}"


def _sentence(failure: AnalysisFailure) -> str:
    return f"{failure.name}: no {failure.what}: {failure.sentence}"


def _benches(results: CampaignResults) -> tuple[BenchSection, ...]:
    """Group recordings that say the same of their bench, so that it is said once."""
    groups: dict[tuple[object, ...], list[str]] = {}
    for facts in results.facts:
        said = (bench_rows(facts), channel_rows(facts), version_rows(facts))
        groups.setdefault(said, []).append(facts.name)
    return tuple(
        BenchSection(", ".join(names), *said)  # type: ignore[arg-type]
        for said, names in groups.items()
    )
