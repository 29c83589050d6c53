"""What every core of one axis has: encoder, timing, options, widths, latencies, ports."""
