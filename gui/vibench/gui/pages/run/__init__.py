"""The Run page: arming in plain words, starting, and live pictures of the run.

Newest seconds of every channel, spectra, transmissibility with coherence, phase portrait and
Poincaré section, responses over the frequency played, level meters. Samples come from the live
view of the engine link; the file holds more than is drawn.
"""
