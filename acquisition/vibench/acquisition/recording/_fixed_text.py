"""Text in a fixed number of UTF-8 bytes: what every HDF5 reader can show, unlike variable-length strings."""

ELLIPSIS = "…"


def encoded(text: str, width: int) -> bytes:
    """UTF-8 bytes of ``text``, at most ``width`` of them; what does not fit gives way to an ellipsis."""
    raw = text.replace("\0", "").encode("utf-8", "replace")
    if len(raw) <= width:
        return raw
    room = width - len(ELLIPSIS.encode())
    return (raw[:room].decode("utf-8", "ignore") + ELLIPSIS).encode()


def decoded(raw: bytes) -> str:
    """Text of a fixed-length field, without its padding."""
    return bytes(raw).rstrip(b"\0").decode("utf-8", "replace")
