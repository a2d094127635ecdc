"""The report of a campaign, or of one recording, as one self-contained HTML file."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path

from vibench.sim.maps import MapResults

from ..dynamics import BranchDiagram
from ..errors import NotEnoughData
from ..figures.hidden_motion import hidden_impacts_figure, hidden_motion_figure
from ..hidden_motion import HiddenMotion
from ..kinds.analysis_kind import AnyResult
from ..recordings.checks import Verdict
from ..results.campaign_results import AnalysisFailure, CampaignResults, FailedStep
from ._drawings import DRAWINGS, figures_together, recording_figures, result_sentence
from ._findings import limits
from ._laid_branches import laid_branches, laid_maps
from ._page import Agreement, Card, Fold, Page, ReportTable, write_page
from ._recording_section import bench_table, channel_table, check_table, measured_table, version_table
from ._result_tables import uncertainty_table
from ._summary import summary

CHANGE_A_CONCLUSION = frozenset({"How it ended", "Seal", "Overloads", "Drop-outs", "Drive level"})
"""Checks whose warnings say that a result is wrong or not the planned one; those of others qualify it."""
_MOST_NUMBERS = 3


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
        Hidden motions of these recordings.
    maps
        Maps on which the levels of stepped sines and sweeps are laid.

    Raises
    ------
    NotEnoughData
        When there are neither results nor failures to report.

    """
    if not results.results and not results.failures:
        raise NotEnoughData(f"{results.name!r} has no recordings, so there is nothing to report")
    failed = {each.name.removesuffix(".part").removesuffix(".h5"): each for each in results.failures}
    cards = [_card(each, failed) for each in results.in_order]
    together = [*figures_together(results), *laid_branches(results, diagrams), *laid_maps(results, maps)]
    together += [draw(each) for each in hidden for draw in (hidden_motion_figure, hidden_impacts_figure)]
    first = together.pop(0) if len(cards) > 1 and together else next((each.figure for each in cards), None)
    page = Page(
        title=results.name,
        about=_about(results),
        warnings=(
            *(f"{each.name}: no {each.what}: {each.sentence}" for each in results.failures),
            *check_warnings(results, CHANGE_A_CONCLUSION),
        ),
        findings=summary(results, [each.agreement for each in cards]),
        figure=first,
        noun="recording",
        cards=(
            *cards,
            *(
                Card(each.name, f"No result: {each.sentence}", Agreement.OPEN, "")
                for each in results.failures
                if each.what is FailedStep.ANALYSIS
            ),
        ),
        further=Fold("Recordings together, and the model", results.model_said, figures=tuple(together)),
        folds=tuple(_benches(results)),
        limits=tuple(limits(results)),
    )
    return write_page(page, path, figures_folder)


def _about(results: CampaignResults) -> str:
    count, origins = len(results.facts), {each.is_simulated for each in results.facts}
    which = "Some of these recordings come" if len(origins) > 1 else "These recordings come"
    said = "This recording comes" if count == 1 else which
    where = f" {said} from {'simulated instruments' if True in origins else 'a real bench'}."
    return f"Report of {count} recording{'' if count == 1 else 's'}.{where if origins else ''}"


def _card(result: AnyResult, failed: Mapping[str, AnalysisFailure]) -> Card:
    facts, drawing = result.analysis.facts, DRAWINGS[result.kind]
    figure, *more = drawing.figures(result)
    agreement, look_at = agreement_of(result, failed.get(facts.name))
    warned = [each for each in result.analysis.checks if each.verdict is Verdict.WARNING]
    looks = [each for each in (look_at, ", ".join(each.what.lower() for each in warned)) if each]
    return Card(
        name=facts.name,
        result=result_sentence(result),
        agreement=agreement,
        look_at="; ".join(looks),
        numbers=tuple(islice(drawing.numbers(result), _MOST_NUMBERS)),
        warnings=tuple(f"{each.what}: {each.text}" for each in warned),
        figure=figure,
        folds=(
            Fold(
                "Statistics and uncertainty",
                tables=(*(build((result,)) for build in drawing.tables), uncertainty_table((result,))),
                figures=tuple(more),
            ),
            Fold(
                "Checks, settings and levels",
                tables=(check_table(result.analysis.checks), measured_table(facts)),
                figures=recording_figures(result),
            ),
        ),
    )


def agreement_of(result: AnyResult, failure: AnalysisFailure | None) -> tuple[Agreement, str]:
    """Say whether the measurement could be one of the simulated draws, and if not yes, why.

    Parameters
    ----------
    failure
        Why there is no simulation, where one was tried.

    """
    laid = result.laid
    if laid is None:
        return Agreement.OPEN, "not simulated" if failure is None else failure.sentence
    if not laid.run.driven.by_voltage:
        return Agreement.OPEN, f"simulated once, under the recorded base{laid.run.why and ': '}{laid.run.why}"
    outside = [each.name for each in laid.ensemble if each.compared and not each.agrees]
    if outside:
        return Agreement.NO, f"outside of the simulated draws: {', '.join(outside)}"
    compared, every = sum(each.compared > 0 for each in laid.ensemble), len(laid.ensemble)
    if not compared:
        return Agreement.OPEN, "too few simulated draws of the measured kind of motion"
    return Agreement.YES, "" if compared == every else f"{compared} of {every} quantities were compared"


def check_warnings(results: CampaignResults, checks: frozenset[str] | None = None) -> Iterator[str]:
    """Say what to look at before a result is trusted.

    Parameters
    ----------
    results
        As `vibench.analysis.analyse_files` gives them.
    checks
        Names of the checks whose warnings are wanted; by default all.

    Returns
    -------
    A sentence for each check of a recording that ended with a warning.

    """
    for result in results.results:
        for check in result.analysis.checks:
            if check.verdict is Verdict.WARNING and (checks is None or check.what in checks):
                yield f"{result.analysis.facts.name}: {check.what.lower()}: {check.text}"


def _benches(results: CampaignResults) -> Iterator[Fold]:
    """Group recordings that say the same of their bench, so that it is said once."""
    groups: dict[tuple[ReportTable, ...], list[str]] = {}
    for facts in results.facts:
        said = (bench_table(facts), channel_table(facts), version_table(facts))
        groups.setdefault(said, []).append(facts.name)
    for tables, names in groups.items():
        yield Fold("Bench, settings and versions", (f"Recordings: {', '.join(names)}",), tables)
