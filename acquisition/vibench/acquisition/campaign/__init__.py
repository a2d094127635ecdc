"""Run many measurements unattended, with a journal, repeated attempts, notices and a folder catalogue.

The state of every point is committed to an SQLite journal before and after each step, so a killed campaign
resumes at its first unfinished point. Each attempt at a point is recorded in a separate file (``NAME.h5``,
``NAME.2.h5``). Notices can be sent by a command or by mail. `estimate_campaign` estimates time and disk
space; `list_recordings` lists a folder's recordings. The package runs in the calling program, without an
engine process. See docs/campaigns.md and docs/decisions/0014-chains-of-points.md.

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
