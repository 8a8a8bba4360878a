"""Simulated devices on pseudo-terminals, and the planar world that they move in and see."""
