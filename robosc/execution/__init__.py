"""Parts that make a supervisor run: an executor, and the reference interpreter of supervisors.

Import from the modules: generated packages carry copies of those that run without the rest of RoboSC.
"""
