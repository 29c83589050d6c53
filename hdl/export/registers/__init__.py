"""Files that describe the registers of a core on a bus."""
