"""Signals are arrays: recordings, pin traces, runs, tables."""
