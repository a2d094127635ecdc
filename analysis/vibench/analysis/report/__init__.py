"""Reports: one self-contained HTML file with figures and tables of results.

A report on a campaign, one recording or a comparison is written for screen and print, with findings and
limits in sentences. This package also chooses the figures of each result and their order; it contains no
analysis. The page on speed and accuracy is docs/accuracy.md. Figures are drawn without a display, with a
caption and tables of the plotted numbers, and saved as PNG, SVG or PDF. The same data give identical files.

>>> from vibench.analysis.report import table
>>> table("curve", frequency_hz=[95.0, 266.0], response=[9.1, 4.2]).column("response")
(9.1, 4.2)
"""

from typing import Any

import lazy_loader

from vibench.acquisition import require_extra

_WITHOUT_FIGURES = {"SHOWN", "ImageKind", "Table", "table"}
_public_name, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    if name in __all__ and name not in _WITHOUT_FIGURES:
        require_extra("figures")
    return _public_name(name)
