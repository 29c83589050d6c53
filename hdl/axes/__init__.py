"""Many axes through one datapath."""
