"""The commands by which a person in a terminal watches, commands and drives a robot whose bridge runs elsewhere.

They use only the bridge's service and import nothing else, so that a stop is sent without delay.
"""
