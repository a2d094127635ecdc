"""Figures and claims of the paper; the modules of this package are the shipped scripts of studies/paper.

>>> from vibench.cli.paper.options import Case
>>> Case(gap_m=30e-6).specimen().gap_m
3e-05
"""

from vibench.acquisition import shipped_folder

__path__ = [str(shipped_folder("studies") / "paper")]
