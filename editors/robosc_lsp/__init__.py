"""Language server of RoboSC, for the Language Server Protocol 3.17."""
