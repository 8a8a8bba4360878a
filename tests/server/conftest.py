"""Common setup of the tests of the server."""

from support.held_time import loop as loop
from support.process_log import log_as_before as log_as_before
