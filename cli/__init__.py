"""The command `tachometry` reads options, calls one study, and prints its report."""
