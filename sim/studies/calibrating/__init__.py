"""Measure the disc of an encoder from captures."""
