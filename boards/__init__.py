"""Where it runs: programs that talk to a core."""
