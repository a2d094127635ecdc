"""Figures and claims of Gong et al. (2025); run by `vibench figure` and `vibench reproduce`."""
