"""Reserved words of CIF."""

FUNCTIONS = frozenset(
    """
    acos acosh asin asinh atan atanh cos cosh sin sinh tan tanh abs cbrt ceil del empty exp floor fmt ln log max min
    pop pow round scale sign size sqrt bernoulli beta binomial constant erlang exponential gamma geometric lognormal
    normal poisson random triangle uniform weibull
    """.split()
)
"""Names of the functions that the language has."""

OPERATOR_WORDS = frozenset({"and", "div", "in", "mod", "not", "or", "sample", "sub"})

KEYWORDS = (
    frozenset(
        """
        alg alphabet any attr automaton bool break case const cont continue controllable def der dict disables disc dist
        do edge elif else end enum equation event false file final for func goto group id if import initial input int
        invariant list location marked monitor namespace needs now plant post pre print printfile real requirement
        return self set string supervisor svgcopy svgfile svgin svgmove svgout switch tau text time to true tuple type
        uncontrollable urgent value void when while
        """.split()
    )
    | OPERATOR_WORDS
    | FUNCTIONS
)
"""Words that are names only behind a `$`."""

INPUT_OUTPUT = frozenset({"svgfile", "svgcopy", "svgmove", "svgout", "svgin", "printfile", "print"})
"""First words of declarations about pictures and printing."""

ROLES = frozenset({"plant", "requirement", "supervisor"})
