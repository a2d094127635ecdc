"""The report: one HTML file with everything in it, for a screen and for paper."""
