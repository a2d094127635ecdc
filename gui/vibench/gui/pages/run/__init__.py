"""The Run page: description of the armed test, start button, and live pictures of the run.

It shows the newest seconds of every channel, spectra, transmissibility with coherence, phase portrait and
Poincaré section, responses over the actual drive frequency, and level meters. The samples come from the live
view of the engine link; the file contains more samples than are drawn.
"""
