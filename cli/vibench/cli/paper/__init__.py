"""The figures and claims of the paper: the scripts of studies/paper, as a checkout or a wheel holds them.

>>> from vibench.cli.paper.options import FigureOptions
>>> FigureOptions(gap_m=30e-6).specimen().gap_m
3e-05
"""

from vibench.acquisition import shipped_folder

__path__ = [str(shipped_folder("studies") / "paper")]
