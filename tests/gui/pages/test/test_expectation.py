"""The Test page says how well a test will tell what it is made for, under what the specimen will do."""

from pathlib import Path

import pytest

from vibench.acquisition.plan import Dwell, Measurement
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
