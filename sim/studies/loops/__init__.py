"""Control loops about a motor."""
