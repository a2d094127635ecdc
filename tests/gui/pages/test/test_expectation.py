"""The Test page says how well a test will tell what it is made for, under what the specimen will do."""

from pathlib import Path

import pytest

from vibench.acquisition.excitation import BaseLevel
from vibench.acquisition.plan import BranchContinuation, Dwell, Measurement
from vibench.acquisition.rig import load_rig
from vibench.gui.pages import test as test_room
from vibench.gui.pages.test import _test_preview as preview

RIG = load_rig(Path(__file__).parents[4] / "hardware_configs" / "virtual_rig.toml")


@pytest.fixture
def page(context):
    page = test_room.TestPage(context)
    yield page
    page.close()


def test_the_expected_uncertainty_stands_under_the_prediction(page):
    plan = Dwell(amplitude_vpp=0.05, frequency_hz=260, settle_s=1, duration_s=6)
    page._predicted(preview.predict_test(preview.TestPreview(Measurement(name="weak", excitation=plan), RIG)))
    assert page.expectation.text().startswith("Will be known: Response II: ± ")
    assert "Response I: not known beforehand" in page.expectation.toolTip()
    page._prediction_failed(ValueError("no"))
    assert page.expectation.text() == ""


def test_a_branch_that_the_fast_loop_does_not_hold_is_no_complete_test_and_the_page_says_why(page):
    rig = load_rig(Path(__file__).parents[4] / "hardware_configs" / "virtual_rig_controller.toml")
    plan = BranchContinuation(
        amplitude_vpp=4, base_level=BaseLevel(displacement_m=1e-6), start_hz=95, low_hz=94.5, high_hz=96
    )
    asked = preview.TestPreview(
        Measurement(name="branch", excitation=plan), rig.model_copy(update={"specimen": RIG.specimen})
    )
    page._looked(preview.preview_test(asked))
    assert page.is_done
    page._predicted(preview.predict_test(asked))
    assert page.summary.text().startswith("✖ whether the fast loop holds the branch is not known")
    assert not page.is_done
