"""The Run page: description of the armed test, start button, and live plots of the run.

It shows the newest seconds of every channel, spectra, transmissibility with coherence, and level meters. For
sines it also shows phase portrait, Poincaré section, and responses over the drive frequency. The samples come
from the live view of the engine link; the file contains more samples than are drawn.
"""
