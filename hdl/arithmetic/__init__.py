"""Arithmetic that several datapaths share: reciprocals, scalers, dividers."""
