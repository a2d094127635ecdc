"""The hardware configuration of a rig: signal chain, channels, limits, linear model, and manual settings.

`load_rig` reads the configuration from TOML; with the table ``[virtual]`` the rig is simulated. `RigModel`
describes the chain from voltage at the generator's terminal to amplifier, coil, table and specimen, which
acts back on the table (`vibench.sim.shaker`). Clipping and the table's stops are not included. `KnobSheet`
lists the manual settings that an operator has confirmed. This package opens no instrument and does not depend
on plans. See docs/hardware.md.

Peak acceleration of the table [m/s2] per volt at the generator, at 260 Hz:

>>> from vibench.acquisition import shipped
>>> from vibench.acquisition.rig import BaseQuantity, RigModel, channels_of, load_rig
>>> rig = load_rig(shipped("hardware_configs/virtual_rig.toml"))
>>> f"{abs(RigModel(rig).transfer(BaseQuantity.ACCELERATION, 260.0)):.1f}"
'35.1'
>>> [channel.role.value for channel in channels_of(rig)]
['drive_voltage', 'amplifier_voltage', 'base_acceleration', 'm0_velocity']
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
