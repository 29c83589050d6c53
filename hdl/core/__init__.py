"""Whole cores: all that is a top, and the encoder that the demo emulates."""
