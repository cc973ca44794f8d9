"""The measures: one question each, shared by the scenes that ask it."""
