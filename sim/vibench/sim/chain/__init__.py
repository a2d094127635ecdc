"""Chains of vibro-impact cells: many specimens, one hanging on the next, and their impacts."""
