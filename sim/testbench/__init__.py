"""Testbenches that stand on their own."""
