"""The demo: a tachometer with registers beside an emulated encoder, to be put on a board."""
