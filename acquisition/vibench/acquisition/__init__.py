"""Plan vibration tests, carry them out within the limits of the rig, and record every sample.

From plan to file: `plan` says what to measure (frozen, validated values), `rig` which hardware, a bench
is the open instruments of a rig, `run_measurement` and `run_campaign` carry plans out, `recording` is the
HDF5 file. SI units; hardware-facing names carry theirs (``frequency_hz``, ``amplitude_vpp`` peak to peak
at the generator). Leaving a bench silences the generator, whatever happened; nothing is ever overwritten.
It knows nothing of analysis, windows and commands, and opens `vibench.virtual_rig` by name only, when a
rig's configuration has a table ``[virtual]``. Names resolve on first use: reading a plan loads no
instrument library. See docs/architecture.md and docs/hardware.md.

>>> from vibench.acquisition import load_campaign, shipped
>>> campaign = load_campaign(shipped("campaigns/quick.toml"))
>>> campaign.name, len(campaign.points()), round(campaign.duration_s)
('quick', 15, 63)
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
