"""Errors are shown at the field that causes them, even if only the whole model finds them."""

import pytest

from vibench.analysis.dynamics import BranchRequest, ChainRequest, SpectrumRequest
from vibench.analysis.prediction.progress import MapRequest, SimulationRequest
from vibench.gui.forms.model_form import ValidatedForm
from vibench.gui.pages.simulate.simulate_page import BRANCHES, CHAIN

HIDDEN = BRANCHES.hidden | CHAIN.hidden
GIVEN = {"start": 60.0, "stop": 62.0}
"""Required values of a request."""


@pytest.mark.parametrize(
    "model", [SimulationRequest, MapRequest, BranchRequest, SpectrumRequest, ChainRequest]
)
@pytest.mark.parametrize(
    ("field", "value", "said"),
    [("specimen", "nothing", "no specimen is called"), ("model", "rubber", "Contact 'rubber' is not known")],
)
def test_unknown_specimens_and_contact_laws_show_an_error_at_their_field(qapp, model, field, value, said):
    form = ValidatedForm(model, "scene", HIDDEN)
    if field not in form.form.editors:
        pytest.skip("the models of a simulation are a list")
    form.form.show_content(GIVEN | {field: value})
    assert form.value is None
    assert said in form.form._rows[field].complaint.sentence
    form.form.show_content(GIVEN)
    assert form.value is not None
    form.close()
