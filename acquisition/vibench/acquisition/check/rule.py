"""What is asked of the check of a bench before anything on it is armed."""

from enum import StrEnum


class CheckRule(StrEnum):
    """How fresh the check of a bench must be."""

    FRESH = "fresh"
    """One that passed within the last ``check_valid_h`` hours, on this very configuration."""
    NOW = "now"
    """One made now."""
    WAIVED = "waived"
    """None; the recordings say what the last one found, if there was one."""
