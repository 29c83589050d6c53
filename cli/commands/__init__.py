"""The commands of `tachometry`."""
