"""CIF front end: texts of the Compositional Interchange Format to automata.

Text -> syntax tree (`parser`) -> components with their names and types (`scopes`, `typing`) -> `robosc.automata.System`
(`lowering`); `check_cif` does all of these steps. It accepts the models that CIF's data-based synthesis accepts, and
reports a finding for each unsupported part.
"""

from robosc.cif.check import SUFFIX, check_cif, load_cif

__all__ = ["SUFFIX", "check_cif", "load_cif"]
