"""Setup that holds for the tests of the server."""

from support.process_log import log_as_before as log_as_before
