"""The figures and claims of Gong et al. (2025), as `vibench figure` and `vibench reproduce` run them.

Each `figure_NN_...` has two functions: `studies` returns what is computed, `draw` draws it. Each `..._claims`
holds one section of what the paper says, one function a claim.
"""
