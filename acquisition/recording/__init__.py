"""The HDF5 recording: its layout, writing, finalising, recovering and reading."""
