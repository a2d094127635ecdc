"""The Test page shows the predicted motion and the expected uncertainty of a test."""

import pytest

from tests.gui.geometry import wrongly_enabled
from vibench.acquisition.excitation.plan import BaseLevel
from vibench.acquisition.plan import Dwell, Measurement, Until
from vibench.acquisition.rig import load_rig
from vibench.gui.pages.test import test_preview as preview
from vibench.gui.pages.test.test_page import TestPage as Page, summary_text

RIG = load_rig("virtual_rig")


@pytest.fixture
def page(context):
    page = Page(context)
    yield page
    page.close()


def test_the_expected_uncertainty_is_shown_below_the_prediction(page):
    plan = Dwell(amplitude_vpp=0.05, frequency_hz=260, settle_s=1, duration_s=6)
    page._on_result(preview.predict_test((Measurement(name="weak", excitation=plan), RIG)))
    assert page.expectation.text().startswith("Expected uncertainty: Response II: ± ")
    assert "Response I: not known beforehand" in page.expectation.toolTip()
    page._on_failure(ValueError("no"))
    assert page.expectation.text() == ""


def test_a_test_with_the_key_until_shows_its_predicted_time(page):
    plan = Dwell(amplitude_vpp=0.05, frequency_hz=260, settle_s=1, duration_s=60)
    test = Measurement(name="weak", excitation=plan, until=Until(response_ii=0.01))
    page._on_result(preview.predict_test((test, RIG)))
    assert page.expectation.text().startswith("Records until the targets are met, about 2 s. Expected")


def test_a_branch_that_the_fast_loop_cannot_hold_is_refused_with_the_reason(page):
    fast_loop = pytest.importorskip(
        "vibench_fast_loop.branch_continuation", reason="pip install -e extensions/fast_loop"
    )
    rig = load_rig("virtual_rig_controller")
    plan = fast_loop.BranchContinuation(
        amplitude_vpp=4, base_level=BaseLevel(displacement_m=1e-6), start_hz=95, low_hz=94.5, high_hz=96
    )
    asked = (Measurement(name="branch", excitation=plan), rig.model_copy(update={"specimen": RIG.specimen}))
    page._show_preview(preview.preview_test(asked))
    assert page.is_done
    page._on_result(preview.predict_test(asked))
    assert page.summary.text().startswith("✖ it is not known whether the fast loop holds the branch")
    assert not page.is_done


def test_every_exceeded_limit_is_among_the_reasons(page):
    """The reason "49 of 45 N" was missing when the stroke was exceeded too."""
    seen = preview.preview_test(
        (
            Measurement(
                name="loud", excitation=Dwell(amplitude_vpp=20, frequency_hz=30, settle_s=1, duration_s=2)
            ),
            RIG,
        )
    )
    passed = [check for check in seen.checks if not check.is_kept]
    assert len(passed) > 1
    said = summary_text(seen)
    assert said.startswith("✖ ")
    assert all(check.complaint() in said for check in passed)


def test_the_prediction_is_not_repeated_when_a_test_is_renamed(page, qtbot):
    page.context.selection.choose_rig(RIG)
    plan = Dwell(amplitude_vpp=0.05, frequency_hz=260, settle_s=1, duration_s=6)
    page.form.show_value(Measurement(name="before", excitation=plan))
    assert page.is_busy
    asked = []
    page._looking.ask = page._predicting.ask = asked.append
    page.form.show_value(Measurement(name="after", excitation=plan))
    assert asked == []
    assert page.context.selection.measurement.name == "after"
    page._show_preview(preview.preview_test((page._inputs[0], RIG)))
    assert not any(map(wrongly_enabled, page.displayed_results))
    assert page.is_done
    page.form.show_value(Measurement(name="after", excitation=plan.model_copy(update={"duration_s": 7.0})))
    assert len(asked) == 2
