"""Recordings as they are listed, opened and looked at."""
