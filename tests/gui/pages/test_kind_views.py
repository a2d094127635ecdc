"""Every kind of excitation has its live plots."""

from vibench.acquisition.plan import EXCITATION_KINDS, Family
from vibench.gui.pages.run.run_page import KIND_VIEWS, LivePicture


def test_every_excitation_has_live_plots_and_only_noise_shows_spectra():
    assert set(KIND_VIEWS) == set(EXCITATION_KINDS)
    for word, kind in EXCITATION_KINDS.items():
        is_noise = kind.plan.family is Family.NOISE
        assert (KIND_VIEWS[word].left is LivePicture.FREQUENCY_RESPONSE) == is_noise, word
        assert (KIND_VIEWS[word].right is LivePicture.SPECTRUM) == is_noise, word
