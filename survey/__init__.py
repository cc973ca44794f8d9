"""Parameter surveys of mechanical systems whose stability decides everything."""
