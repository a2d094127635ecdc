"""The virtual rig at a low sample rate, with a generator that no other test uses."""

import itertools

from vibench.acquisition.rig import Rig, load_rig

from .changed import changed

_serials = itertools.count(1)


def small_rig() -> Rig:
    """Return the virtual rig with a separate generator on the bus."""
    resource = f"USB0::0x0699::0x0353::B{next(_serials):04d}::INSTR"
    return changed(load_rig("virtual_rig"), daq={"sample_rate_hz": 5120}, generator={"resource": resource})
