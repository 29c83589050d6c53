"""The virtual encoder: how a shaft moves, and what the lines of its encoder do meanwhile."""
