"""Recordings and predictions laid over one another."""
