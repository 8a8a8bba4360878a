"""C code of a supervisor: its library and example program, for the target `c99` and for packages in C++."""
