"""The Qt window: a viewer and a remote control of the measurement.

It keeps no truth of its own: what it shows of a run is what the engine's process said last.
Rooms, each above those it uses: `window`; `pages` (independent of each other); `page`;
`engine_link`, `plots`; `background`, `forms`, `widgets`.
Qt (PySide6, pyqtgraph) is imported here and in no other package; whatever takes longer than a
frame is computed in a spawned process. Guide: docs/gui.md.

    $ vibench-gui --bench BENCH.toml
    $ python -m vibench.gui --screenshots DIR
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
