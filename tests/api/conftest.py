"""Common setup of the tests of what server and client share."""

from support.held_time import loop as loop
