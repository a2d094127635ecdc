"""Reports: one HTML file with everything in it, figures and tables of results, and measured accuracy.

A campaign, one recording or a comparison is written for a screen and for paper, with its findings in
sentences and what it cannot say. Also chosen here: which figures a result has, in which order. The page
on speed and accuracy is docs/accuracy.md. Results are taken as they are: nothing is analysed here.

>>> from vibench.analysis.report import table
>>> table("curve", frequency_hz=[95.0, 266.0], response=[9.1, 4.2]).column("response")
(9.1, 4.2)
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
