"""The hardware configuration of a rig: signal chain, channels, limits, linear model, knobs set by hand.

`load_rig` reads it from TOML; the table ``[virtual]`` makes it a simulated one. `RigModel` is the chain
from a volt at the generator's terminal to amplifier, coil, table and the specimen that pushes back on it
(`vibench.sim.shaker`), without clipping and the table's stops. `KnobSheet` is what an operator confirmed
by hand. Only values and arithmetic: nothing here opens an instrument or knows a plan. See
docs/hardware.md.

The peak acceleration of the table [m/s2] for one volt at the generator, at 260 Hz:

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
