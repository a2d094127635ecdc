"""Recordings go out to other programs, and other programs' files come in."""
