"""Test, show and record a board for `tachometry monitor`."""
