"""The Run page: arming in plain words, starting, and live pictures of the run.

Newest seconds of every channel, spectra, transmissibility with coherence, phase portrait and Poincaré
section, responses over the actual drive frequency, level meters. The engine link's live view supplies the
samples; the file holds more than is drawn.
"""
