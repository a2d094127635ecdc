"""The figures and claims of Gong et al. (2025), for `vibench figure` and `vibench reproduce`.

Each `figure_NN_...` has two functions: `studies` returns the required studies, `draw` draws the figure. Each
`..._claims` contains the claims of one section of the paper, one function per claim.
"""
