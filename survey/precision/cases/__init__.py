"""What the work-precision charts measure, one file per scene."""
