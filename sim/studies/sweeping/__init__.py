"""Many cores on many motions."""
