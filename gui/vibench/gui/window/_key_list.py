"""The keys, as F1 lists them."""

KEYS: tuple[tuple[str, str], ...] = (
    ("Esc, Pause", "abort: ramp down as fast as the shaker bears, from anywhere"),
    ("Ctrl+1 … Ctrl+7", "show a page"),
    ("F1", "this list"),
    ("F5", "start what is armed"),
    ("F6", "check the bench"),
    ("Ctrl+Return", "arm"),
    ("Space", "freeze the picture (Run page); the recording goes on"),
    ("M", "mark an event in the recording (Run page)"),
    ("A, L", "autoscale, logarithmic axis (in a plot)"),
    ("Ctrl+T", "light or dark"),
    ("Ctrl+C", "copy the message, or the picture of a plot"),
    ("Ctrl+Q", "quit"),
)
"""No bare letter ever starts an output."""


def key_text() -> str:
    """Lay the keys out as rows of a table, for rich text."""
    rows = "".join(f"<tr><td><b>{key}</b>&nbsp;&nbsp;</td><td>{what}</td></tr>" for key, what in KEYS)
    return f"<table>{rows}</table>"
