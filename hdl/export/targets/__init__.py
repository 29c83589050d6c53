"""Files for frameworks into which a core goes."""
