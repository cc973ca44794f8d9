"""How it is carried out: the plan, blocks through dask, edges and cells beside them, the file as it grows."""
