"""A virtual rig whose instruments can be made to fail and are opened by address, like real ones."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from vibench.acquisition.rig import Rig
from vibench.virtual_rig import VirtualRig

Laboratory = Callable[..., tuple[VirtualRig, Rig]]


@pytest.fixture
def laboratory(rig: Rig) -> Iterator[Laboratory]:
    """Return a function that starts a virtual rig, and the configuration of a bench on it."""
    with ExitStack() as opened:

        def start(**habits) -> tuple[VirtualRig, Rig]:
            virtual = opened.enter_context(VirtualRig(rig, **habits))
            connected = rig.model_copy(
                update={
                    "virtual": None,
                    "daq": rig.daq.model_copy(update={"server": virtual.daq_address}),
                    "generator": rig.generator.model_copy(update={"resource": virtual.visa_resource}),
                }
            )
            return virtual, connected

        yield start
