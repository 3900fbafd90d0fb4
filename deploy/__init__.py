"""Robots, hosts and the way to start them."""
