"""Numbers only: no labels, files, threads or units (`.ci/imports.py` keeps it so)."""
