"""Plan vibration tests, carry them out within the limits of the rig, and record every sample.

`plan` describes the measurements (frozen, validated values) and `rig` the hardware; a bench is the open
instruments of a rig. `run_measurement` and `run_campaign` carry plans out; `recording` is the HDF5 file.
SI units; hardware-facing names end in their unit (``frequency_hz``, ``amplitude_vpp`` peak to peak at the
generator). Leaving a bench silences the generator, even after an error. No file is ever overwritten.
The package does not use analysis, windows or commands. It loads `vibench.virtual_rig` by name, only when a
rig's configuration has a table ``[virtual]``. Names resolve on first use: reading a plan loads no
instrument library. See docs/architecture.md and docs/hardware.md.

>>> from vibench.acquisition import load_campaign, shipped
>>> campaign = load_campaign(shipped("campaigns/quick.toml"))
>>> campaign.name, len(campaign.points()), round(campaign.duration_s)
('quick', 15, 63)
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
