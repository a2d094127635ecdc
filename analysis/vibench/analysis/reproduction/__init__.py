"""Every claim of the paper that has a number or a direction, measured, judged and written down.

A claim is measured under a case: one reading of everything that the paper leaves open. Where the
defaults do not uphold it, named alternatives are tried in order; all claims are scored over a range of
dampings, whose unit the paper leaves open. Studies are computed once, and the page is docs/reproduction.md.

>>> from vibench.analysis.reproduction import SECTIONS
>>> SECTIONS["Resonances"][0].says
'Without collisions m0 resonates at 95, 266 and 500 Hz.'
>>> sum(len(claims) for claims in SECTIONS.values())
53
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
