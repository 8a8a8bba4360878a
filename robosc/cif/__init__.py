"""CIF front end: texts of the Compositional Interchange Format to automata.

Text -> syntax tree (`parser`) -> instantiated specification (`specification`) -> `robosc.automata.System` (`lowering`).
"""
