"""Read and write the captures of logic analysers and simulators."""
