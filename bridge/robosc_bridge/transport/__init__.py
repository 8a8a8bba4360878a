"""Transport of bytes on a line: opening, waiting, reading, writing and closing, with one kind of errors."""
