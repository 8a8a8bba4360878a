"""Common parts of the C++ nodes, whatever their middleware: around the supervisor in C99, tables and conversions."""
