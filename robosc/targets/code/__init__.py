"""Parts that generators of code share: texts, names, expressions. A target imports these, and no other target."""
