"""From the measured velocity to the ports: filter, unit, age."""
