"""Reports: one self-contained HTML file with figures and tables of results.

A report on a campaign, one recording or a comparison is written for screen and print, with findings and
limits in sentences. This package also chooses the figures of each result and their order; it contains no
analysis. The page on speed and accuracy is docs/accuracy.md.

>>> from vibench.analysis.report import table
>>> table("curve", frequency_hz=[95.0, 266.0], response=[9.1, 4.2]).column("response")
(9.1, 4.2)
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
