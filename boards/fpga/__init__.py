"""Describe boards, what goes on them, and the tools that build and load it."""
