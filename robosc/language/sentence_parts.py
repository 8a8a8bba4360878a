"""Parts of sentences of other languages: what stands between their phrases, as conditions and requests of the text."""

from collections.abc import Sequence

import msgspec
from msgspec.structs import replace

from robosc.language.control_node_states import negation
from robosc.language.control_nodes import Declared
from robosc.language.phrases import MOODS, OUTCOMES, UNITS, Mood, Time, is_noise, phrase_at, time_in
from robosc.language.tokens import Kind, Tokens
from robosc.language.vocabulary import Message, Vocabulary
from robosc.language.words import spelled

_NAME, _WORD, _NUMBER, _STRING = (int(kind) for kind in (Kind.NAME, Kind.WORD, Kind.NUMBER, Kind.STRING))

_OPERATORS = {"&&": "and", "||": "or", "==": "=", "&": "and", "|": "or"}
_SIGNS = frozenset("and or = != < <= > >= + - * / ( ) ! not true false".split())
_IS = frozenset({"is", "in", "at", "=", "==", "becomes", "reaches", "be"})
SEPARATORS = {"{": "then", "}": "", ",": "then", ":": "then"}
"""Signs that part a sentence, with the words that they stand for."""


class Advice(msgspec.Struct, frozen=True):
    """Advice on a sentence.

    Attributes:
        index: Token that the message is about.
        word: The word that is no word of the language, as it is written.
        reason: Reason why it does not fit.
        meant: Text that says the same, or empty.
        more: Text in the robot that it needs, or that says the same if `meant` is empty.
        age: Communication and text of a `max_age` that says the same; None: another text does.
        begin: First token that `meant` replaces.
        end: Token behind the last one that `meant` replaces.
    """

    index: int
    word: str
    reason: str
    begin: int
    end: int
    meant: str = ""
    more: str = ""
    age: tuple[str, str] | None = None


class Operand(msgspec.Struct, frozen=True):
    """A part of a sentence.

    Attributes:
        condition: It as a condition, or empty.
        message: The communication that it names, or None.
        is_negative: True if it is not to happen.
        is_cancelled: True if it is to be ended where it runs.
        more: Other communications that it means.
    """

    condition: str = ""
    message: Message | None = None
    is_negative: bool = False
    is_cancelled: bool = False

    more: tuple[Message, ...] = ()

    @property
    def request(self) -> str:
        """Name of the request that it is, or those of several in braces, or empty."""
        asked = [spelled(item.name) for item in (self.message, *self.more) if item is not None and item.is_requested]
        return f"{{ {', '.join(asked)} }}" if len(asked) > 1 else next(iter(asked), "")


class SentenceParts:
    """Reader of parts of sentences; never raises.

    Args:
        text: All of the text.
        tokens: Its tokens.
        declared: Names in it.
    """

    def __init__(self, text: str, tokens: Tokens, declared: Declared) -> None:
        self._text = text
        self._texts, self._kinds, self._starts = tokens
        self._declared = declared
        self._vocabulary = Vocabulary(tokens)

    def _words(self, indices: Sequence[int]) -> list[str]:
        """Tokens in lower case; names of the model are replaced by what no phrase contains."""
        found = []
        for index in indices:
            token = self._texts[index]
            is_path = "." in (self._texts[index - 1], self._texts[index + 1])
            is_message = token.casefold() in self._vocabulary.messages
            is_name = self._kinds[index] in (_NAME, _WORD) and (is_path or is_message)
            word = SEPARATORS.get(token, token.casefold())
            if token == "of" and self._texts[index - 1].casefold() in UNITS:
                # `within 5 seconds of`
                word = "after"
            found.append(f".{token}" if is_name else word)
        return found

    def _written(self, begin: int, end: int) -> str:
        return self._text[self._starts[begin] : self._starts[end - 1] + len(self._texts[end - 1])]

    def _without_times(self, indices: list[int]) -> tuple[list[int], list[tuple[int, Time]]]:
        """Return tokens without those of times, and the times with their first tokens."""
        times: list[tuple[int, Time]] = []
        names = self._vocabulary.messages
        while (time := time_in(self._words(indices), names)) is not None:
            times.append((indices[time.begin], time))
            indices = indices[: time.begin] + indices[time.end :]
        return indices, times

    def _operand(self, indices: Sequence[int]) -> Operand | None:
        """Return what a part of a sentence says; None: it is not known."""
        indices = list(indices)
        words = self._words(indices)
        while words and (is_noise(words[0]) or not words[0]):
            indices, words = indices[1:], words[1:]
        while words and (is_noise(words[-1]) or not words[-1]):
            indices, words = indices[:-1], words[:-1]
        if not indices:
            return None
        if len(words) > 2 and words[-1] in ("true", "false") and words[-2] in ("is", "="):
            operand = self._operand(indices[: -3 if words[-3] == "=" else -2])
            if operand is None or words[-1] == "true":
                return operand
            return Operand(negation(operand.condition)) if operand.condition else None
        return self._of_message(indices) or self._of_component(indices, words) or self._expression(indices)

    def _of_message(self, indices: list[int]) -> Operand | None:
        """A communication, alone or behind its component, perhaps with what has become of it."""
        texts = [self._texts[index] for index in indices]
        if texts[1:2] == ["."] and texts[0] in self._vocabulary.components and len(texts) > 2:
            indices, texts = indices[2:], texts[2:]
        message = self._vocabulary.messages.get(texts[0].casefold())
        rest = [text for text in texts[1:] if text != "." and not is_noise(text.casefold())]
        if message is None:
            return None
        if not rest:
            return Operand(self._after(message), message)
        outcome = OUTCOMES.get(rest[0].casefold())
        if outcome is None or len(rest) > 1:
            return None
        state = message.states.get(outcome, "")
        return Operand(state) if state else None

    def _after(self, message: Message) -> str:
        """The condition that holds once something was received or done, or empty."""
        boolean = next((name for name, type_ in message.variables.items() if type_ == "boolean"), "")
        if not message.is_requested:
            return boolean or message.states.get("response", "")
        states = [message.states.get(event, "") for event in ("response", "request")]
        if message.kind == "action":
            # Its end is no state of its own if it leads to where it began.
            states = states[:1]
        return next((state for state in states if self._vocabulary.leads_on(state)), "")

    def _of_component(self, indices: list[int], words: list[str]) -> Operand | None:
        """A state in words: `Door is ajar`, `ajar`."""
        texts = [self._texts[index] for index in indices]
        if len(texts) == 1:
            condition = self._vocabulary.state_with(texts[0])
            return Operand(condition) if condition else None
        part = self._vocabulary.components.get(texts[0])
        middle = words[1:-1]
        if part is None or not all(word in _IS or is_noise(word) for word in middle):
            return None
        state = next(
            (each for each in (*part.states, *part.variables) if each.casefold() == texts[-1].casefold()), None
        )
        return None if state is None else Operand(f"{texts[0]}.{spelled(state)}")

    def _expression(self, indices: list[int]) -> Operand | None:
        """A condition made of states, variables and operators."""
        out: list[str] = []
        at = 0
        while at < len(indices):
            token = self._texts[indices[at]]
            following = [self._texts[index] for index in indices[at + 1 : at + 3]]
            part = self._vocabulary.components.get(token)
            if part is not None and following[:1] == ["."] and len(following) == 2:
                names = {name.casefold(): name for name in (*part.states, *part.variables)}
                message = self._vocabulary.messages.get(following[1].casefold())
                name = names.get(following[1].removeprefix("^").casefold())
                condition = f"{token}.{spelled(name)}" if name else self._after(message) if message else ""
                if not condition:
                    return None
                out.append(condition)
                at += 3
                continue
            if token in ("=", "&", "|") and following[:1] == [token]:
                at += 1
                continue
            if token.casefold() in _SIGNS or token in _OPERATORS:
                out.append(_OPERATORS.get(token, token.casefold()))
            elif self._kinds[indices[at]] in (_NUMBER, _STRING) or (out and out[-1] in ("=", "!=")):
                out.append(token)
            else:
                message = self._vocabulary.messages.get(token.casefold())
                condition = self._after(message) if message else self._vocabulary.state_with(token)
                if not condition:
                    return None
                out.append(condition)
            at += 1
        return Operand(_spaced(out)) if _is_whole(out) else None

    def _action(self, indices: Sequence[int], *, guesses: bool = False) -> Operand | None:
        """Return what is to happen, or not to; None: it is not known.

        Args:
            indices: The tokens.
            guesses: True if a single unknown name stands for what the robot may request.
        """
        indices = list(indices)
        words = self._words(indices)
        is_negative = is_cancelled = False
        while words:
            found = phrase_at(words, 0, MOODS)
            if found is None:
                if words[0] and not is_noise(words[0]):
                    break
                indices, words = indices[1:], words[1:]
                continue
            mood, end = found
            is_cancelled = is_cancelled or mood is Mood.CANCEL
            is_negative = is_negative or mood in (Mood.NOT, Mood.CANCEL)
            indices, words = indices[end:], words[end:]
        if not indices:
            # A robot that is stopped requests nothing that moves.
            moving = self._vocabulary.moving() if is_negative else []
            return Operand("", moving[0], is_negative=True, more=tuple(moving[1:])) if moving else None
        operand = self._operand(indices)
        moving = self._vocabulary.moving() if guesses else []
        if operand is None and moving and len(indices) == 1 and self._kinds[indices[0]] == _NAME:
            operand = Operand("", moving[0])
        if operand is None:
            return None
        return replace(operand, is_negative=is_negative, is_cancelled=is_cancelled)

    def _condition(self, indices: Sequence[int], action: Operand | None = None) -> str:
        """Some tokens as a condition; of a single unknown name, another condition that shows the way."""
        operand = self._operand(indices)
        if operand is not None:
            return operand.condition
        names = [index for index in indices if self._kinds[index] == _NAME]
        rest = [self._texts[index] for index in indices if index not in names]
        if len(names) == 1 and not rest and action is not None and action.message is not None:
            return self._vocabulary.any_condition(action.message.component)
        return ""

    def _failed(self, indices: Sequence[int]) -> str:
        """The state that the failure of something leads to, or empty."""
        operand = self._operand(indices)
        return "" if operand is None or operand.message is None else operand.message.states.get("error", "")

    def _plain(self, indices: Sequence[int]) -> str:
        """A single name or path that nothing declares, as it is written."""
        texts = [self._texts[index] for index in indices]
        is_path = all(text == "." if at % 2 else text.isidentifier() for at, text in enumerate(texts))
        return "".join(texts) if is_path and len(texts) % 2 else ""

    def _timer(self) -> tuple[str, str]:
        """Free names for a component and its message."""
        vocabulary = self._vocabulary
        return vocabulary.free("Timer", vocabulary.components), vocabulary.free("elapsed", vocabulary.messages)


def age_text(seconds: float) -> str:
    """A time as `max_age` takes it."""
    text = f"{seconds:.6f}".rstrip("0")
    return f"{text}0" if text.endswith(".") else text


def _is_whole(out: Sequence[str]) -> bool:
    """Return True if operands and operators alternate as they should."""
    depth, is_operand_next = 0, True
    for token in out:
        if is_operand_next and token in ("!", "not", "(", "-"):
            depth += token == "("
        elif is_operand_next and token not in _SIGNS - {"true", "false"}:
            is_operand_next = False
        elif not is_operand_next and token == ")":
            depth -= 1
        elif not is_operand_next and token in _SIGNS - {"(", ")", "!", "not", "true", "false"}:
            is_operand_next = True
        else:
            return False
    return depth == 0 and not is_operand_next


def _spaced(out: Sequence[str]) -> str:
    """Tokens as one text."""
    text = ""
    for token in out:
        text += token if not text or text[-1] in "(!" or token == ")" else f" {token}"
    return text


__all__ = ["SEPARATORS", "Advice", "Operand", "SentenceParts", "age_text"]
