"""Drive bases and range scanners behind one narrow interface per kind."""
