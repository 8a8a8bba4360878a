"""The C++ headers that nodes on roscpp run on."""
