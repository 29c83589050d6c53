"""The methods: what each measures, its options, widths and latencies."""
