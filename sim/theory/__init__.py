"""Each equation of the papers is a function here, vectorised over numpy arrays.

Both papers number their equations from (1); names say which is meant.
"""
