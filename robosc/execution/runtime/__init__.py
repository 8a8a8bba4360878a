"""
Executors of supervisors.

Generated packages carry copies of these modules, which run on Python 3.8 and later.
"""
