"""Reference values to 30 and more digits; each file says how they were made."""
