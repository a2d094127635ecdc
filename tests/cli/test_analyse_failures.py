"""Exit codes of `analyse`: a missing result fails, a missing simulation does not."""

import pytest
import typer

from vibench.analysis.results.campaign_results import AnalysisFailure, CampaignResults, FailedStep
from vibench.cli.analyse import complain_about


def end_of_analysis(what):
    return CampaignResults("night", (), (AnalysisFailure("a.h5", what, "the reason"),))


def test_a_missing_simulation_is_noted_without_a_failure(capsys):
    complain_about(end_of_analysis(FailedStep.SIMULATION))
    assert capsys.readouterr().err == "note: a.h5: the reason\n"


def test_a_recording_without_a_result_is_a_failure(capsys):
    with pytest.raises(typer.Exit) as end:
        complain_about(end_of_analysis(FailedStep.ANALYSIS))
    assert end.value.exit_code == 1
    assert capsys.readouterr().err == "error: a.h5: the reason\n"
