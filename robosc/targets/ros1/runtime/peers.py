"""
Nodes on this node's topics that use another type, in words.

ROS 1 refuses such a connection and tells the node that made it, if at all. The master knows who is
on a topic, and each node the types that it uses.

A copy of this module stands in generated packages, which run on Python 3.8 and later.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

LOOKS = 3
"""A node that did not tell its types is asked again at one look in so many."""

ANY_TYPE = '*'


class Peers:
    """
    Nodes on topics, looked at again and again in a thread of its own.

    :param name: This node's name.
    :param topics: Name, type and whether this node sends there, of every topic.
    :param proxy: Function that makes the proxy of a node of its URI, a context manager.
    """

    def __init__(
        self, name: str, topics: Iterable[tuple[str, str, bool]], proxy: Callable[[str], Any]
    ) -> None:
        self._name = name
        self._topics = tuple(topics)
        self._proxy = proxy
        self._looks = 0
        # The types of a node's topics as a sender and as a receiver, by its URI; None if it did
        # not answer.
        self._known: dict[str, dict[tuple[str, bool], str] | None] = {}

    def misfits(self, master: Any) -> tuple[str, ...]:
        """
        Return what keeps other nodes from being connected.

        :param master: The master's proxy.
        """
        self._looks += 1
        code, _, state = master.getSystemState(self._name)
        if code != 1:
            return ()
        senders, receivers = dict(state[0]), dict(state[1])
        found, used = [], set()
        for topic, type_name, sends in self._topics:
            for node in (receivers if sends else senders).get(topic, ()):
                if node == self._name:
                    continue
                uri = self._uri_of(master, node)
                used.add(uri)
                other = self._types_of(uri, topic, not sends).get((topic, not sends), type_name)
                if other not in (type_name, ANY_TYPE):
                    own, others = ('sends', 'takes') if sends else ('takes', 'sends')
                    found.append(f'{topic}: {node} {others} {other}, this node {own} {type_name}')
        self._known = {uri: types for uri, types in self._known.items() if uri in used}
        return tuple(sorted(found))

    def _uri_of(self, master: Any, node: str) -> str:
        code, _, uri = master.lookupNode(self._name, node)
        return str(uri) if code == 1 else ''

    def _types_of(self, uri: str, topic: str, sends: bool) -> dict[tuple[str, bool], str]:
        """Return the types of a node's topics, asking it if a topic is new."""
        types = self._known.get(uri)
        is_news = uri not in self._known or (types is not None and (topic, sends) not in types)
        if uri and (is_news or (types is None and self._looks % LOOKS == 0)):
            types = self._known[uri] = self._ask(uri)
        return types or {}

    def _ask(self, uri: str) -> dict[tuple[str, bool], str] | None:
        try:
            with self._proxy(uri) as node:
                answers = ((node.getPublications, True), (node.getSubscriptions, False))
                return {
                    (topic, sends): type_name
                    for ask, sends in answers
                    for topic, type_name in ask(self._name)[2]
                }
        except Exception:
            # It was killed, and the master still knows it; or it is busy.
            return None
