"""Common parts of the C++ nodes for every middleware: tables and conversions around the supervisor in C99."""
