"""Methods and what others use, side by side on the same edges."""
