"""Every core of one axis has an encoder, timing, options, widths, latencies and ports."""
