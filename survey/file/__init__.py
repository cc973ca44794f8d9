"""What is kept: labels, finished blocks, the netCDF file, what an unfinished run has left."""
