"""Each row of a report states agreement, disagreement or neither with a reason, also without a result."""

from types import SimpleNamespace as Of

import pytest

from tests.reading_reports import Page
from vibench.analysis import CampaignResults
from vibench.analysis.report import Agreement, write_report
from vibench.analysis.report._report import agreement_of
from vibench.analysis.results.campaign_results import AnalysisFailure, FailedStep

GOOD, BAD, OPEN = (
    Of(name=name, compared=compared, agrees=agrees)
    for name, compared, agrees in (("Response II", 9, True), ("Response I", 1, False), ("band", 0, True))
)
NOT_SIMULATED = AnalysisFailure("a.h5", FailedStep.SIMULATION, "it did not reach its end")


def result_with(*ensemble, by_voltage=True, why=""):
    return Of(overlay=Of(run=Of(driven=Of(by_voltage=by_voltage), why=why), ensemble=ensemble))


@pytest.mark.parametrize(
    ("result", "failure", "agreement", "reason"),
    [
        (result_with(GOOD), None, Agreement.YES, ""),
        (result_with(GOOD, OPEN), None, Agreement.YES, "1 of 2 quantities were compared"),
        (result_with(GOOD, BAD, OPEN), None, Agreement.NO, "outside of the simulated draws: Response I"),
        (result_with(OPEN), None, Agreement.OPEN, "the same kind of motion as the measurement"),
        (result_with(), None, Agreement.OPEN, "the same kind of motion as the measurement"),
        (
            result_with(GOOD, by_voltage=False),
            None,
            Agreement.OPEN,
            "simulated once, from the recorded base",
        ),
        (
            result_with(by_voltage=False, why="no gain"),
            None,
            Agreement.OPEN,
            "recorded base: no gain",
        ),
        (Of(overlay=None), None, Agreement.OPEN, "not simulated"),
        (Of(overlay=None), NOT_SIMULATED, Agreement.OPEN, "it did not reach its end"),
    ],
)
def test_the_agreement_verdict_names_the_compared_quantities(result, failure, agreement, reason):
    found, said = agreement_of(result, failure)
    assert found is agreement
    assert said.endswith(reason)
    assert bool(said) is bool(reason)


def test_a_report_with_only_failures_names_every_failure_with_its_reason(tmp_path):
    failed = tuple(AnalysisFailure(f"{each}.h5", FailedStep.ANALYSIS, f"{each} is cut") for each in "ab")
    page = Page(write_report(CampaignResults("x", (), failed), tmp_path / "x.html").read_text("utf-8"))
    assert page.findings == "Two recordings of two gave no result."
    assert "a.h5 No result: a is cut cannot tell" in page.visible
    assert "No analysis: b.h5: b is cut" in page.visible.split("Two recordings")[0]
