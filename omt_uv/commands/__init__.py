"""One module for each command of the command line: `add` declares its options, `run` carries it out."""
