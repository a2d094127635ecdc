"""The engine: one process that owns a bench, and the small protocol by which others ask it."""
