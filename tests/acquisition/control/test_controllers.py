"""Every kind with feedback has a controller, and no other."""

from vibench.acquisition.control.controllers import CONTROLLERS
from vibench.acquisition.excitation.kinds import EXCITATION_KINDS


def test_the_kinds_with_feedback_are_those_with_a_controller():
    assert set(CONTROLLERS) == {word for word, kind in EXCITATION_KINDS.items() if kind.is_feedback}
