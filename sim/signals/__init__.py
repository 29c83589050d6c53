"""Signals as arrays: recordings, pin traces, runs, tables."""
