"""A sweep has settings, from which its points follow."""
