"""Measurements and predictions laid over one another, as curves of one kind."""
