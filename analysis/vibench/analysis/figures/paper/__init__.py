"""The figures of the paper, drawn from our own studies; one file a figure."""
