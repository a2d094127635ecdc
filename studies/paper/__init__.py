"""The figures and claims of Gong et al. (2025), for `vibench figure` and `vibench reproduce`.

Each `..._figures` contains the figures on one subject, and `drawing` what they share. Each `..._claims`
contains the claims of one section of the paper, one function per claim.
"""
