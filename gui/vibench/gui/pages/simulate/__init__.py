"""The scene as a form, and its answer as it grows."""
