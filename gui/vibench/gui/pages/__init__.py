"""The pages of the window, one package a page, independent of each other.

This package imports none of them: functions of a page that are called in another process must
not load the others. They are listed, in the order of the job, in the window's page catalogue.
"""
