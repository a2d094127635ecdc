"""Every kind of excitation can be analysed, laid over and reported; nothing else has a row."""

from vibench.acquisition.plan import EXCITATION_KINDS
from vibench.analysis.kinds import ANALYSES
from vibench.analysis.report import DRAWINGS


def test_every_kind_of_excitation_has_an_analysis():
    assert set(ANALYSES) == set(EXCITATION_KINDS)


def test_every_kind_of_excitation_has_figures_and_sentences():
    assert set(DRAWINGS) == set(EXCITATION_KINDS)
