"""What to measure, measuring it safely, and keeping every sample."""
