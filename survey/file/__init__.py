"""What is kept: labels, finished blocks, the netCDF file, and what an unfinished run has left."""
