"""Draw runs and studies."""
