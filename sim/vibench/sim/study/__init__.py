"""Studies: many scenes as one work queue, on threads or a cluster, kept in HDF5 and resumable."""
