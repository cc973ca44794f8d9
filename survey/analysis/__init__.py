"""What `ds.survey` does (see `survey/accessor.py`): one question to a finished survey per file."""
