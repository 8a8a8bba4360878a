"""The language server: RoboSC's answers to what editors ask, in the Language Server Protocol 3.17."""
