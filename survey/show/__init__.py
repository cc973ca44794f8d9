"""Pictures of a survey: maps and curves, and the motion at one point."""
