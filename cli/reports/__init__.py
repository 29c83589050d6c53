"""Reports format results for the terminal and for files."""
