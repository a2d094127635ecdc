"""Drivers: Tektronix AFG1022 over VISA, NI-DAQmx inputs and outputs.

Each driver implements a protocol of `vibench.acquisition.instruments`: every setting is read back, a refused
setting becomes an error with advice, and outputs are switched off after any error. Only this package imports
pyvisa, nidaqmx and grpc. Drivers know the rig's configuration, but not plans or runs, and cannot distinguish
simulated from real instruments.
"""

import lazy_loader

from ..host.installation import naming_its_extra

_found, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
__getattr__ = naming_its_extra(_found, "bench")
