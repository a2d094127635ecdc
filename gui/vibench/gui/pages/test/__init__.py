"""The Test page: the next signal, its loads, and the predicted response.

A form of one measurement, the signal in time and spectrum, predicted loads beside the limits of
the rig, and the predicted response of the specimen. Preview and prediction are computed in another process.
"""
