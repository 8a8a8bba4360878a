"""Parts that generators of code share: texts, names, expressions, statements. A target imports no other target."""
