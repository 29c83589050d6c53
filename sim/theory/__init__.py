"""The papers' equations, one function each, vectorised over numpy arrays.

Both papers number their equations from (1); names say which is meant.
"""
