"""From the pins to counts per tick and position."""
