"""Benchmarks: the figures this project stands by, beside their baselines."""
