"""Make testbenches that stand on their own."""
