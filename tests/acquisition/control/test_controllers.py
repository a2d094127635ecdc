"""Every excitation with feedback has a controller, and no other excitation has one."""

from vibench.acquisition.control.controllers import CONTROLLERS
from vibench.acquisition.excitation.kinds import EXCITATION_KINDS
from vibench.acquisition.instruments import PlugInKind, plug_in_names


def test_excitations_have_a_controller_if_and_only_if_they_use_feedback():
    of_packages = plug_in_names(PlugInKind.FEEDBACK)
    with_feedback = {word for word, kind in EXCITATION_KINDS.items() if kind.is_feedback}
    assert {*CONTROLLERS, *of_packages} == with_feedback
