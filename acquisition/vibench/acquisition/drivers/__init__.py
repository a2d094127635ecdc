"""Real instruments: Tektronix AFG1022 and Keysight 33500B over VISA, inputs and outputs behind NI-DAQmx.

Each keeps the promises of `vibench.acquisition.instruments`: every setting is read back, every refusal
becomes an error that says what to do, and outputs go off whatever happens. The only place of this package
that imports pyvisa, nidaqmx and grpc. It knows the rig's configuration, and neither plans nor runs; it
cannot tell a simulated instrument from a real one.
"""

import lazy_loader

from ..host.extras import naming_its_extra

_found, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
__getattr__ = naming_its_extra(_found, "bench")
