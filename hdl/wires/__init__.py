"""Ports, registers, delays and synchronisers, which all boxes share."""
