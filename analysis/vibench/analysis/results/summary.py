"""A result as one JSON document: every number with its unit in its name, and its uncertainty beside it."""

from collections.abc import Iterator

from ..kinds.analyses import ANALYSES
from ..kinds.analysis_kind import AnyResult, Json
from ..model.draws import SimulatedRun
from ..model.ensemble import CurveDifference, EnsembleCurve
from ..model.escape import EscapeRate
from ..recordings.facts import RecordingFacts
from ..tables import named, plain
from ..uncertainty.budget import Budget
from .campaign_results import CampaignResults


def result_summary(result: AnyResult) -> Json:
    """Say a result in numbers that JSON can hold; what is not finite becomes null."""
    row, laid = ANALYSES[result.kind], result.laid
    document: Json = {
        "recording": _facts(result.analysis.facts),
        "checks": [
            {"what": each.what, "verdict": each.verdict.value, "text": each.text}
            for each in result.analysis.checks
        ],
        "kind": row.family,
        "measured": row.measured(result.analysis),
        "uncertainty": [each.to_dict() for each in budgets_of(result)],
        "simulated": None
        if laid is None
        else {
            **_run(laid.run),
            "difference": _difference(laid.difference),
            "ensemble": [_ensemble(each) for each in laid.ensemble],
            "escape": None if laid.escape is None else _escape(laid.escape),
            **row.simulated(laid),
        },
    }
    return dict(plain(document))


def budgets_of(result: AnyResult) -> tuple[Budget, ...]:
    """Give the budget of uncertainty of each number that a reader takes away from a result.

    Returns
    -------
    A budget each for A0 and Responses I and II of a dwell, the largest of both of a sweep or of steps,
    and for frequency, damping and transmissibility at each resonance under noise (JCGM 100:2008).

    """
    found: tuple[Budget, ...] = ANALYSES[result.kind].budgets(result.analysis, result.laid)
    return found


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
        "failures": [{"recording": f.name, "what": f.what, "error": f.sentence} for f in results.failures],
    }


def _facts(facts: RecordingFacts) -> Json:
    return {
        "name": facts.name,
        "path": str(facts.path),
        "state": facts.state.value,
        "reason": facts.reason,
        "origin": facts.origin.value,
        **named(facts, "started_utc", "bench_check", "recording_id"),
        **named(facts, "duration_s", "sample_rate_hz", "requested_sample_rate_hz"),
        "excitation": facts.measurement.excitation.model_dump(mode="json"),
        "overload_s": dict(facts.overload_s),
        **named(facts, "dropouts", "dropout_s", "lost_samples"),
        "feedback": [
            {"kind": each.kind, "time_s": time_s, **each.numbers}
            for time_s, each in zip(facts.feedback_s, facts.feedback, strict=True)
        ],
    }


def _run(run: SimulatedRun) -> Json:
    return {
        "drive": run.driven.value,
        **named(run, "why", "draws", "base_band_hz"),
        "accuracy": run.accuracy.value,
        "masses_kg": run.specimen.masses,
        "stiffnesses_n_per_m": run.specimen.stiffnesses,
        "dampings_ns_per_m": run.specimen.dampings,
        "gap_m": min(run.specimen.gaps_m),
        "gaps_m": run.specimen.gaps_m,
        "impacts": run.impacts,
        "impact_rate_hz": run.impact_rate_hz,
    }


def _ensemble(found: EnsembleCurve) -> Json:
    return {
        "quantity": found.name,
        "agrees": found.agrees if found.compared else None,
        **named(found, "compared", "outside", "largest_z"),
        "limit_z": found.limit,
        **named(found, "share_in_band", "frequency_hz", "measured", "median", "lower", "upper", "z", "rank"),
        "draws": found.count,
    }


def _escape(found: EscapeRate) -> Json:
    low, high = found.bounds_per_s
    return {
        **named(found, "what", "runs", "ends"),
        "measured_ended": found.measured.ended,
        "measured_end_s": found.measured.stop_s,
        "counted_from_s": found.from_s,
        **named(found, "events", "exposure_s", "per_s"),
        "per_s_lower": low,
        "per_s_upper": high,
    }


def _difference(found: CurveDifference) -> Json:
    return {
        "median_abs_db": found.median_abs_db,
        "rms_db": found.rms_db,
        "share_within_two_standard_errors": found.share_within_two,
    }
