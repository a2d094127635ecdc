"""Window values equal those of scipy."""

import numpy as np
import pytest
from scipy.signal import get_window

from vibench.analysis.signals import Window, taper


@pytest.mark.parametrize("window", Window)
@pytest.mark.parametrize("samples", [1, 2, 7, 64, 1001])
def test_a_window_equals_the_periodic_window_of_scipy(window, samples):
    expected = get_window(window.value, samples, fftbins=True)
    assert taper(window, samples) == pytest.approx(expected, abs=1e-13)
    assert taper(window.value, samples).dtype == np.float64
