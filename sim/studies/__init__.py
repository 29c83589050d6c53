"""Studies: what a core promises, and how well methods do on the same edges."""
