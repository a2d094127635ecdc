"""Plan vibration tests, carry them out within the limits of the rig, and record every sample.

`plan` describes the measurements as frozen, validated values, and `rig` describes the hardware. A bench is
the set of open instruments of a rig. `run_measurement` and `run_campaign` carry out plans; `recording` reads
and writes their HDF5 files. Units are SI; the names of hardware quantities end in their unit
(``frequency_hz``, ``amplitude_vpp`` peak to peak at the generator). Leaving a bench silences the generator,
even after an error. No file is ever overwritten. The package imports nothing from analysis, gui or cli.
`vibench.virtual_rig` is loaded only for a configuration with a table ``[virtual]``. Public names are imported
on first use, so reading a plan loads no instrument library. See docs/architecture.md and docs/hardware.md.

>>> from vibench.acquisition import load_campaign, shipped
>>> campaign = load_campaign(shipped("campaigns/quick.toml"))
>>> campaign.name, len(campaign.points()), round(campaign.duration_s)
('quick', 15, 63)
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
