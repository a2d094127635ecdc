"""Every kind of excitation can be analysed, overlaid and reported; other entries are refused."""

import pytest

from vibench.acquisition.plan import EXCITATION_KINDS, Family, rows_by_kind
from vibench.analysis.kinds import ANALYSES
from vibench.analysis.report import DRAWINGS


def test_every_kind_of_excitation_has_an_analysis():
    assert set(ANALYSES) == set(EXCITATION_KINDS)
    assert ANALYSES["held_sweep"] is ANALYSES["sine_sweep"]
    assert ANALYSES["stepped_level"] is not ANALYSES["stepped_sine"]


def test_every_kind_of_excitation_has_figures_and_report_sentences():
    assert set(DRAWINGS) == set(EXCITATION_KINDS)


def test_a_registry_entry_for_an_unknown_kind_of_excitation_is_refused():
    with pytest.raises(KeyError, match="chirp"):
        rows_by_kind(dict.fromkeys(Family, 1), {"chirp": 2})
