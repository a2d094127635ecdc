"""The Test page: what will be played, and what it will do.

A form of one measurement, the signal in time and spectrum, predicted loads beside the limits of
the rig, and the predicted response of the specimen. Preview and prediction are computed in another process.
"""
