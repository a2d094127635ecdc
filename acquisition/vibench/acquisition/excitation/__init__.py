"""What the generator plays: one excitation a file."""
