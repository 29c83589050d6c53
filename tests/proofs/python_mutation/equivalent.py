"""Mutants that change nothing that could be seen, each with the argument, by its name."""

# A name is `file: function: before → after`, as `make mutate` prints it.
ARGUED: dict[str, str] = {}
