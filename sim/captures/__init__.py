"""Captures of logic analysers and simulators, read and written."""
