"""The page of `tachometry explore`: what it asks, what answers it, and the server between them."""
