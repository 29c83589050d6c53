"""In what a spec is written: options, quantities with units, ports."""
