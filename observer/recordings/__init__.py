"""Recorded sensor data of any planar platform: read, judged, run through the observer."""
