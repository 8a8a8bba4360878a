"""What the C++ nodes share, whatever their middleware: around the supervisor in C99, tables and conversions."""
