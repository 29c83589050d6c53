"""What a sweep is asked for, and the points that it consists of."""
