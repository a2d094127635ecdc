"""A result as one JSON document: every number with its unit in its name, and its uncertainty beside it."""

from collections.abc import Iterator

from ..kinds.analyses import ANALYSES
from ..kinds.analysis_kind import AnyResult, Json
from ..tables import plain
from ..uncertainty.budget import Budget
from .campaign_results import CampaignResults


def result_summary(result: AnyResult) -> Json:
    """Say a result in numbers that JSON can hold; what is not finite becomes null."""
    analysis = result.analysis
    return {
        "recording": plain(analysis.facts),
        "checks": plain(analysis.checks),
        "kind": ANALYSES[result.kind].family,
        "measured": plain(analysis),
        "uncertainty": plain(budgets_of(result)),
        "simulated": plain(result.laid),
    }


def budgets_of(result: AnyResult) -> tuple[Budget, ...]:
    """Return the budget of uncertainty of each number that a reader takes away from a result.

    Returns
    -------
    A budget each for A0 and Responses I and II of a dwell, the largest of both of a sweep or of steps,
    and for frequency, damping and transmissibility at each resonance under noise (JCGM 100:2008). Those of a
    recording that lasted until its results were known are widened, see `Budget.widened`.

    """
    found: tuple[Budget, ...] = ANALYSES[result.kind].budgets(result.analysis, result.laid)
    has_chosen_end = result.analysis.facts.measurement.until is not None
    return tuple(each.widened() for each in found) if has_chosen_end else found


def budget_sentences(results: CampaignResults) -> Iterator[str]:
    """Say the numbers of each recording with their uncertainty and what it is made of, a sentence each."""
    for each in results.in_order:
        for budget in budgets_of(each):
            yield f"{each.analysis.facts.name}: {budget.sentence}."


def campaign_summary(results: CampaignResults) -> Json:
    """Say all results of a campaign, and what failed."""
    return {
        "campaign": results.name,
        "results": [result_summary(each) for each in results.results],
        "failures": plain(results.failures),
    }
