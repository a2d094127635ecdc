"""Reports: one HTML file with everything in it, figures and tables of results, and measured accuracy.

A campaign, one recording or a comparison is written for a screen and for paper, with its findings in
sentences and what it cannot say. Also chosen here: which figures a result has, in which order. The page
on speed and accuracy is docs/accuracy.md. Results are taken as they are: nothing is analysed here.

>>> from vibench.analysis.report import FigureOptions, FrequencyGrid
>>> options = FigureOptions(damping_time_s=2e-5, grid=FrequencyGrid.COARSE)
>>> len(options.frequencies_hz), options.frequencies_hz[-1]
(120, 600.0)
>>> options.sentence.partition(" accuracy")[0]
'Options: c = 2e-05 s · k, gap 45 µm, standard'
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
