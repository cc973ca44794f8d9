"""What `ds.survey` does (see `survey/accessor.py`): one question asked of a finished survey per file."""
