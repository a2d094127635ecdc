"""Recordings and predictions become transmissions, spectra, responses, figures and reports."""
