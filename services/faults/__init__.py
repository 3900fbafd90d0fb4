"""Faults on purpose: what goes wrong between and inside the services, by seed, and the verdict."""
