"""A map in one HTML file that opens anywhere: `page` assembles it from the scripts beside it."""
