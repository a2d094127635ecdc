"""Channels in the SDyPy format (SEP 005) are accepted by SDyPy's own model."""

import numpy as np
import pytest

from vibench.analysis.exchange import excerpt, sep005

model = pytest.importorskip("sdypy_sep005.sep005", reason="pip install vibench[test] brings sdypy-sep005")


def test_sdypy_accepts_every_channel_with_its_values(known, known_values):
    channels = sep005(excerpt(known))
    assert [each["name"] for each in channels] == list(known.roles)
    for each in channels:
        read = model.Sep005Data.model_validate(each)
        np.testing.assert_allclose(read.data, known_values[each["name"]], rtol=1e-12)
        assert read.fs == known.sample_rate_hz
    assert [each.get("quantity") for each in channels] == [None, "v"]


def test_an_excerpt_has_a_later_start_time_stamp(known):
    whole, part = (sep005(excerpt(known, (), start))[0]["start_timestamp"] for start in (None, 1.0))
    assert np.datetime64(part.split("+")[0]) - np.datetime64(whole.split("+")[0]) == np.timedelta64(1, "s")
