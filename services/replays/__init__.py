"""The observer run again over a recorded log."""
