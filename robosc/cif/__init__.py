"""CIF front end: texts of the Compositional Interchange Format to automata.

Text -> syntax tree (`parser`) -> components with their names and types (`scopes`, `typing`) -> `robosc.automata.System`
(`lowering`); `check_cif` goes all the way. It takes the models that CIF's data-based synthesis takes, and reports what
it does not take with a finding for each place.
"""

from robosc.cif.check import SUFFIX, check_cif, load_cif

__all__ = ["SUFFIX", "check_cif", "load_cif"]
