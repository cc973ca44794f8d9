"""What is asked of a finished survey, one question per file: what `ds.survey` does (see `survey/accessor.py`)."""
