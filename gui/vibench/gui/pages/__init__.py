"""The pages of the window, one package a page, independent of each other.

This package imports none of them, because a function of one page that runs in another process must not load
the other pages. The window's page catalogue lists them in the order of the job.
"""
