"""Motions that repeat: harmonic balance, shooting, their branches, and where they lose their stability."""
