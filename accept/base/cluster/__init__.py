"""Work on many machines: an existing Dask scheduler and its workers, or workers of this machine."""
