"""Campaigns: many trials of one experiment, on every core there is or on a Dask cluster.

An experiment is one file in ``services/trials/experiments`` (docs/trials.md).
"""
