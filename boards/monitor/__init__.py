"""What `tachometry monitor` does with a board: self-test, view, recording."""
