"""The commands of `robosc-client`: each module adds some to the parser, and runs them."""
