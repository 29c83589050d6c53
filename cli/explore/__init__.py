"""The page of `tachometry explore`: what it asks, what answers it, and the server between them."""

# Nothing but what comes with the page is loaded, run, or asked.
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'"
)
