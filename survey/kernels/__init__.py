"""Numbers only: no labels, files, processes or units (`lint-imports` keeps it so)."""
