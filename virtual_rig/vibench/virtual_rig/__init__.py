"""The simulated laboratory: function generator, USB cable, DAQ service, and the analogue world between them.

Unmodified pyvisa finds an AFG1022, and unmodified nidaqmx finds a converter behind a gRPC port. The samples
are simulated in rig time, from the generator's output through amplifier, shaker, specimen, vibrometer and
converter. Faults occur on demand or by a script (docs/campaigns.md). Configuration, errors and disk faults
come from `vibench.acquisition`, physics from `vibench.sim`; no driver, plan or run is imported. Only a bench
and ``vibench serve-rig`` start the rig (levels and time steps: docs/decisions/0006-virtual-rig.md).

::

    with VirtualRig(load_rig(path)) as rig:  # rig.visa_resource for pyvisa, rig.daq_address for nidaqmx
        ...

In another process, ``plug_in_remote(rig.daq_address)`` puts the generator on pyvisa's USB bus.

>>> from vibench.acquisition import shipped
>>> from vibench.virtual_rig import load_fault_script
>>> script = load_fault_script(shipped("hardware_configs/faults/night.toml"))
>>> len(script.faults), script.faults[0].fault, script.faults[0].at_s
(20, 'drop_laser', 600.0)
"""

import lazy_loader

from vibench.acquisition import naming_its_extra

_found, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
__getattr__ = naming_its_extra(_found, "bench")
