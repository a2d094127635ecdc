"""The Files page: recordings of a folder, as a list and as plots.

It has a table with state and thumbnail of each recording, its channels over time at any zoom, and a
spectrogram. Folders and overviews are read in another process.
"""
