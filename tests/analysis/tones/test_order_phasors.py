"""Order phasors computed by multiplication equal the complex exponentials."""

import numpy as np
import pytest

from vibench.analysis.tones import ALL_ORDERS, order_turns


@pytest.mark.parametrize("orders", [ALL_ORDERS, (1.0,), (5 / 12, 7 / 11, 1.0), (0.37, 1.0, np.sqrt(2))])
def test_order_phasors_computed_by_products_match_exponentials_over_a_long_dwell(orders):
    phase = np.linspace(-3.0, 2 * np.pi * 500 * 60, 20_001)
    exact = np.exp(1j * np.multiply.outer(np.asarray(orders), phase))
    assert order_turns(phase, orders) == pytest.approx(exact, abs=1e-9)
