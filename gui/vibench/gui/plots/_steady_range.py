"""Axes that follow the data without trembling."""

ROOM = 0.15
"""Empty share of the range at either end after a change."""
LEAST_USED = 0.5
"""Share of the range that the data must fill, or it is drawn larger."""

Range = tuple[float, float]


def steady_range(shown: Range, data: Range) -> Range | None:
    """Give the range to change to, or None while the data is inside and fills enough of what is shown."""
    low, high = data
    size = high - low
    is_inside = shown[0] <= low and high <= shown[1]
    if is_inside and size >= LEAST_USED * (shown[1] - shown[0]):
        return None
    if size <= 0.0:
        # A dead signal: some room around it, whatever its unit.
        half = 0.5 * abs(low) or 1e-3
        wanted = (low - half, high + half)
        return None if is_inside and shown[1] - shown[0] <= 8 * half else wanted
    return low - ROOM * size, high + ROOM * size
