"""Number formats: how exact a result has to be, and the widths and tables that make it so."""
