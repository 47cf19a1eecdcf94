"""Messages by code. Each text of the service has a stable code, typed parameters and an English template.

A package declares its messages in its ``texts.py``. Calling a template returns a :class:`Text`: the English sentence with its code and
parameters. The service sends both; the page translates by code (``frontend/src/lib/serverText.ts``).

A placeholder contains the type of its parameter after a colon:

- ``d``: an integer. ``.1f``, ``.3g``, ``g``: a number in this format.
- ``name``: a text that a person typed or another system sent. It is never translated.
- ``text``: another Text. It is translated by its own code and loses its full stop.
- ``sentence``: another Text that keeps its full stop.
- ``texts``: several Texts, joined by semicolons.
"""

import math
import string
from collections.abc import Mapping
from typing import Any, Final, Self, overload

import msgspec

Param = int | float | str | dict[str, Any] | list[dict[str, Any]]
"""A parameter in the form in which it is sent. A nested Text is an object with ``code``, ``params`` and ``text``."""


class MessageKey(msgspec.Struct, frozen=True):
    """Code and parameters of a text, which are sent together with its English form."""

    code: str
    params: dict[str, Param] = {}


class Text(str):
    """An English text that knows its code and parameters. Formatting it into another string loses both."""

    __slots__ = ("key",)
    key: MessageKey

    def __new__(cls, english: str, key: MessageKey) -> Self:
        """``english``: the template with its parameters filled in."""
        self = super().__new__(cls, english)
        self.key = key
        return self

    def __reduce__(self) -> tuple[type[Self], tuple[str, MessageKey]]:
        """Keep code and parameters when the text is sent to another process."""
        return type(self), (str(self), self.key)

    def __str__(self) -> str:
        """Return the English text as a plain string."""
        return str.__str__(self)

    @property
    def nested(self) -> dict[str, Any]:
        """Return the text as a parameter of another text."""
        return {"code": self.key.code, "params": self.key.params, "text": str(self)}


NO_TEXT: Final = Text("", MessageKey(""))


class Template:
    """A message with its code. Call it with its parameters to get a text."""

    def __init__(self, code: str, english: str) -> None:
        """``english``: English text with placeholders such as ``{motor:d}``; see the module."""
        self.code = code
        self.english = english
        self._parts = tuple((literal, name, spec or "") for literal, name, spec, _ in string.Formatter().parse(english))
        self.params: Mapping[str, str] = {name: spec for _, name, spec in self._parts if name is not None}
        """Type of each parameter by name."""
        self._whole = None if self.params else Text(english.format(), MessageKey(code))

    def __call__(self, **params: object) -> Text:
        """Return the text.

        :raises TypeError: when the parameters differ from the declared ones.
        """
        if params.keys() != self.params.keys():
            raise TypeError(f"{self.code} needs {sorted(self.params)}, not {sorted(params)}")
        if self._whole is not None:
            return self._whole
        english = "".join(
            literal if name is None else literal + _shown(params[name], spec) for literal, name, spec in self._parts
        )
        return Text(
            english, MessageKey(self.code, {name: _sent(params[name], spec) for name, spec in self.params.items()})
        )


CATALOGUE: Final[dict[str, Template]] = {}
"""Every declared message by code. Importing a package's ``texts`` declares the messages of the package."""


def message(code: str, english: str) -> Template:
    """Declare a message and return its template.

    :raises ValueError: when the code is already declared.
    """
    if code in CATALOGUE:
        raise ValueError(f"two messages have the code {code}")
    return CATALOGUE.setdefault(code, Template(code, english))


@overload
def key_of(text: Text) -> MessageKey: ...
@overload
def key_of(text: str | None) -> MessageKey | None: ...
def key_of(text: str | None) -> MessageKey | None:
    """Return the code and parameters of a text, or None for a string that has none."""
    return text.key if isinstance(text, Text) and text.key.code else None


def _shown(value: Any, spec: str) -> str:
    match spec:
        case "name":
            return str(value)
        case "text":
            return str(value).removesuffix(".")
        case "sentence":
            return str(value)
        case "texts":
            return "; ".join(str(text).removesuffix(".") for text in value)
        case "d":
            return str(int(value))
        case _:
            return format(float(value), spec)


def _sent(value: Any, spec: str) -> Param:
    match spec:
        case "name":
            return str(value)
        case "text" | "sentence":
            return _nested(value)
        case "texts":
            return [_nested(text) for text in value]
        case "d":
            return int(value)
        case _:
            # Infinity and NaN are sent as text, because JSON has neither.
            return float(value) if math.isfinite(value) else str(float(value))


def _nested(value: str) -> dict[str, Any]:
    return value.nested if isinstance(value, Text) else {"code": "", "params": {}, "text": str(value)}


def sent_key(text: str | None) -> dict[str, Any] | None:
    """Return the code and parameters of a text as JSON, or None for a string that has none."""
    sent: dict[str, Any] | None = msgspec.to_builtins(key_of(text))
    return sent


def with_key(english: str, key: MessageKey | None) -> Text:
    """Return the text that was sent as its English form and its key. A text without a code gets an empty code."""
    return Text(english, key or MessageKey(""))


def text_of(error: BaseException) -> Text:
    """Return the message of an exception. It has no code unless the exception was raised with a Text."""
    message = error.args[0] if error.args else ""
    return message if isinstance(message, Text) else with_key(str(error), None)
