"""Logs: recorded, written, read back, and where they came from."""
