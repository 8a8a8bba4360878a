"""C of a supervisor: its library and example program, which the target `c99` and packages in C++ hold."""
