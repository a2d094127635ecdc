"""Many measurements, unattended: journal, attempts, reconnecting, notices, and the catalogue of a folder.

The state of every point is committed to an SQLite journal before and after each step: a campaign that was
killed resumes at its first unfinished point. Each attempt is a separate file (``NAME.h5``, ``NAME.2.h5``). A
command or a mail can notify people who are away. `estimate_campaign` estimates time and disk space,
`list_recordings` lists the recordings of a folder. The package starts and stops runs; it does not use the
engine's process or its clients. See docs/campaigns.md and docs/decisions/0014-chains-of-points.md.

>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> from vibench.acquisition import load_campaign, shipped
>>> from vibench.acquisition.campaign import estimate_campaign
>>> from vibench.acquisition.rig import load_rig
>>> campaign = load_campaign(shipped("campaigns/quick.toml"))
>>> rig = load_rig(shipped("hardware_configs/virtual_rig.toml"))
>>> with TemporaryDirectory() as folder:
...     needed = estimate_campaign(campaign, rig, Path(folder))
>>> needed.recordings, needed.kept, round(needed.duration_s)
(15, 0, 63)
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
