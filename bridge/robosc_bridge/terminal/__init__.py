"""The commands by which a person in a terminal watches, commands and drives a robot whose bridge runs elsewhere.

They know the bridge's service alone, and import nothing else, so that a stop is on its way at once.
"""
