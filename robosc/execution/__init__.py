"""Parts that make a supervisor run: `runtime`, executors that generated packages carry copies of, and `interpreter`.

The interpreter is the reference for what generated code does; it is not copied.
"""
