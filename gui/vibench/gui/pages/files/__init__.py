"""The Files page: the recordings of a folder, as a list and as plots.

It has a table with the state and a thumbnail of each recording. The open recording is shown over time, at any
zoom, and as a spectrogram. Folders and overviews are read in another process.
"""
