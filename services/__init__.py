"""Processes and the wire: topics, bus, runners, supervisor, command line."""
