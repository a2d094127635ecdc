"""The Run page: armed in plain words, watched live."""
