class _Converter:
    """textX objects to syntax tree; collects what the grammar alone cannot say."""

    def __init__(self, places: _Places) -> None:
        self.diagnostics: list[Diagnostic] = []
        self._places = places

    def _at(self, node: Any) -> Location:
        return self._places.location(node._tx_position, node._tx_position_end)

    def _keyword(self, node: Any, word: str) -> Location:
        return self._places.location(node._tx_position, node._tx_position + len(word))

    def _report(self, code: str, message: str, location: Location, mend: str) -> None:
        self.diagnostics.append(_error(code, message, location, mend))

    def file(self, root: Any) -> syntax.File:
        """A robot or a library."""
        items = tuple(self._item(item) for item in root.items)
        return syntax.File(_kind(root) == "Library", self._name(root.name), items)

    def _name(self, node: Any) -> syntax.Name:
        text = node.text.removeprefix("^")
        location = self._at(node)
        if len(text) > MAXIMUM_NAME:
            self._report(
                "name-too-long", f"the name has more than {MAXIMUM_NAME} characters", location, "Shorten the name."
            )
        return syntax.Name(text, location)

    def _optional(self, node: Any) -> syntax.Name | None:
        return None if node is None else self._name(node)

    def _item(self, node: Any) -> syntax.Item:
        match _kind(node):
            case "Component":
                return self._component(node)
            case "ObjectType":
                properties = tuple(syntax.Property(self._name(p.name), self._type(p.type)) for p in node.properties)
                return syntax.ObjectDefinition(self._name(node.name), properties)
            case "EnumType":
                rules = tuple(self._rule(rule) for rule in node.rules)
                return syntax.EnumDefinition(self._name(node.name), self._type(node.source), rules)
            case "Interface":
                return syntax.Interface(self._name(node.name), self._name(node.type), self._name(node.package))
            case "Requirement":
                return self._requirement(node)
            case _:
                return self._provide(node)

    def _rule(self, node: Any) -> syntax.EnumRule:
        condition = None if node.condition is None else self._expression(node.condition)
        return syntax.EnumRule(condition, self._name(node.value))

    def _requirement(self, node: Any) -> syntax.Requirement:
        form = node.needs or node.disables
        names = tuple(self._name(name) for name in form.communications.names)
        place = self._keyword(node, "requirement")
        return syntax.Requirement(names, node.needs is None, self._expression(form.expression), place)

    def _provide(self, node: Any) -> syntax.Provide:
        condition = None if node.condition is None else self._expression(node.condition)
        return syntax.Provide(
            self._name(node.communication), self._provided(node.value), condition, self._keyword(node, "provide")
        )

    def _provided(self, node: Any) -> syntax.ObjectValue | syntax.Expression:
        if node.object is None:
            return self._expression(node.expression)
        properties = tuple((self._name(item.name), self._provided(item.value)) for item in node.object.properties)
        return syntax.ObjectValue(properties, self._at(node.object))

    # Components

    def _component(self, node: Any) -> syntax.Component:
        name = self._name(node.name)
        if node.imported is not None:
            source = syntax.Import(self._name(node.imported.library), self._name(node.imported.component))
            return syntax.Component(name, (), source)
        return syntax.Component(name, tuple(self._part(item) for item in node.body.items), None)

    def _part(self, node: Any) -> syntax.Communication | syntax.Behaviour:
        kind = _kind(node)
        if kind == "Behaviour":
            return syntax.Behaviour(
                tuple(self._behaviour_item(item) for item in node.items), self._keyword(node, "behaviour")
            )
        identifier = None if node.identifier is None else self._text(node.identifier.text)
        name, link = self._name(node.name), self._optional(node.link)
        match kind:
            case "Message":
                return syntax.Message(syntax.Direction(node.direction), name, identifier, self._type(node.type), link)
            case "Service":
                return syntax.Service(name, identifier, self._type(node.request), self._type(node.response), link)
            case _:
                request, response = self._type(node.request), self._type(node.response)
                return syntax.Action(name, identifier, request, response, self._type(node.feedback), link)

    def _behaviour_item(self, node: Any) -> syntax.Variable | syntax.State | syntax.Transition:
        match _kind(node):
            case "Variable":
                initial = None if node.initial is None else self._primary(node.initial)
                return syntax.Variable(self._name(node.name), self._type(node.type), initial)
            case "State":
                transitions = tuple(self._transition(item) for item in node.transitions)
                return syntax.State(self._name(node.name), bool(node.initial), bool(node.marked), transitions)
            case _:
                return self._transition(node)

    def _transition(self, node: Any) -> syntax.Transition:
        if _kind(node) == "Tau":
            guard = None if node.guard is None else self._expression(node.guard)
            return syntax.TauTransition(guard, self._optional(node.target), self._keyword(node, "transition"))
        updates = tuple(syntax.Update(self._access(item.target), self._expression(item.value)) for item in node.updates)
        preposition = syntax.Name(node.preposition.text, self._at(node.preposition))
        return syntax.CommunicationTransition(
            node.kind, preposition, self._name(node.communication), updates, self._optional(node.target), self._at(node)
        )

    # Types and expressions

    def _type(self, node: Any) -> syntax.Type:
        if node.array is not None:
            return syntax.ArrayType(self._type(node.array.element), self._at(node))
        if node.name is not None:
            return syntax.NamedType(self._name(node.name))
        if node.integer is not None:
            bounds = node.integer
            if not bounds.low:
                return syntax.BasicType(syntax.BasicTypeName.INTEGER, None, None, self._at(node))
            low, high = self._integer(bounds.low, self._at(node)), self._integer(bounds.high, self._at(node))
            return syntax.BasicType(syntax.BasicTypeName.INTEGER, low, high, self._at(node))
        return syntax.BasicType(syntax.BasicTypeName(node.basic), None, None, self._at(node))

    def _integer(self, text: str, location: Location) -> int:
        digits = text.lstrip("0") or "0"
        # Compared by length first: turning a million digits into a number would take minutes.
        if len(digits) > 10 or int(digits) > 2**31 - 1:
            self._report(
                "integer-too-large", "the number does not fit into 32 bits", location, "Use a number up to 2147483647."
            )
            return 0
        return int(digits)

    def _text(self, node: Any) -> syntax.Text:
        return syntax.Text(unescape(node.token), self._at(node))

    def _expression(self, node: Any) -> syntax.Expression:
        tree = self._flat(node)
        if precedence.depth_of(tree) > MAXIMUM_NESTING:
            self._report(
                "nesting-too-deep",
                f"the expression has more than {MAXIMUM_NESTING} levels",
                self._at(node),
                "Split the expression.",
            )
        return tree

    def _flat(self, node: Any) -> syntax.Expression:
        operands = [self._operand(node.first), *(self._operand(item.operand) for item in node.rest)]
        operators = [(item.operator, self._keyword(item, item.operator)) for item in node.rest]
        return precedence.build(operands, operators, self._report)

    def _operand(self, node: Any) -> syntax.Expression:
        tree = self._flat(node.inner) if node.inner is not None else self._primary(node)
        signs = [(prefix.text, self._at(prefix)) for prefix in node.prefixes]
        for (text, _), (following, place) in pairwise(signs):
            if text == "-" and following == "!":
                self._report(
                    "syntax-error", "'-' cannot stand before '!'; expected a number", place, f"Remove the {text}."
                )
        for text, location in reversed(signs):
            tree = syntax.Unary(text, tree, location)
        return tree

    def _primary(self, node: Any) -> syntax.Literal | syntax.Access:
        if node.number is not None:
            return self._number(node.number)
        if node.string is not None:
            return syntax.Literal(unescape(node.string.token), self._at(node.string))
        if node.boolean is not None:
            return syntax.Literal(node.boolean.word == "true", self._at(node.boolean))
        return self._access(node.access)

    def _number(self, node: Any) -> syntax.Literal:
        location = self._at(node)
        if "." not in node.token:
            return syntax.Literal(self._integer(node.token, location), location)
        value = float(node.token)
        if value == float("inf"):
            self._report("number-too-large", "the number does not fit into a double", location, "Use a smaller number.")
            value = 0.0
        return syntax.Literal(value, location)

    def _access(self, node: Any) -> syntax.Access:
        root = None if node.root.name is None else self._name(node.root.name)
        steps: list[syntax.Name | syntax.Index] = []
        for step in node.steps:
            if step.name is not None:
                steps.append(self._name(step.name))
            else:
                place = self._at(step)
                steps.append(syntax.Index(self._integer(step.index, place), place))
        return syntax.Access(root, tuple(steps), self._at(node))


def unescape(token: str) -> str:
    """The text of a quoted token; a backslash takes the next character, n and t mean newline and tab."""
    special = {"n": "\n", "t": "\t"}
    return re.sub(r"\\([\s\S])", lambda match: special.get(match.group(1), match.group(1)), token[1:-1])


def _kind(node: Any) -> str:
    return type(node).__name__
