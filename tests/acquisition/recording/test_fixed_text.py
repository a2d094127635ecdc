from hypothesis import given, strategies as st

from vibench.acquisition.recording._layout import decode, encode

UTF8 = st.text(st.characters(codec="utf-8", exclude_characters="\0"))


@given(UTF8)
def test_fixed_length_text_that_fits_round_trips(text):
    width = len(text.encode()) + 3
    assert decode(encode(text, width).ljust(width, b"\0")) == text


@given(UTF8, st.integers(3, 40))
def test_fixed_length_text_that_is_too_long_is_cut_between_characters(text, width):
    raw = encode(text, width)
    assert len(raw) <= width
    if len(text.encode()) > width:
        assert text.startswith(raw.decode().removesuffix("…"))
