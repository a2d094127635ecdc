"""The Qt window: a viewer and a remote control of the measurement.

The window shows what the engine process reported last, and keeps no state of a run itself. Inner packages
from top to bottom, each using only packages below it: `window`; `pages` (independent of each other); `page`;
`engine_link`, `plots`; `background`, `forms`, `widgets`. No other package imports Qt (PySide6, pyqtgraph).
Work that takes longer than one frame of the display runs in a spawned process. Guide: docs/gui.md.

$ vibench-gui --bench BENCH.toml
$ python -m vibench.gui --screenshots DIR
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
