"""A map as a file of series that answers anywhere: made by `build` (from `functions`), read by `reader`."""
