"""Parts that run a supervisor: the executors in `runtime`, which are copied into generated packages, and `interpreter`.

The interpreter is the reference for generated code, and is not copied.
"""
