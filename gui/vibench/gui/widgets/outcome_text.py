"""How a run came out, in words that are written once."""


def outcome_text(state: str, reason: str) -> str:
    """Join state and reason: ``"stopped by the operator"``, ``"failed: the laser was lost"``."""
    return reason if reason.startswith(state) else f"{state}: {reason}" if reason else state
