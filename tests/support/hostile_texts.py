"""Five hundred texts that would run a script on an unsafe page."""

from base64 import b64encode
from collections.abc import Callable
from html import escape
from itertools import product
from typing import Final
from urllib.parse import quote

CALL: Final = "kataHostile(1)"
"""Function that each of them would call; the test defines it."""

_SHAPES: Final = (
    "<script>{}</script>",
    '"><script>{}</script>',
    "</script><script>{}</script>",
    "</title><script>{}</script>",
    "</textarea></style><script>{}</script>",
    "--><script>{}</script><!--",
    "<svg><script>{}</script></svg>",
    "<svg/onload={}>",
    "<img src=x onerror={}>",
    "'><img src=x onerror='{}'>",
    "<iframe srcdoc='<script>parent.{}</script>'></iframe>",
    "<iframe src=javascript:parent.{}></iframe>",
    "<a href='javascript:{}' autofocus>link</a>",
    "javascript:{}",
    '" autofocus onfocus="{}" x="',
    "' autofocus onfocus='{}' x='",
    "<details open ontoggle={}>",
    "<video><source onerror={}></video>",
    "<input autofocus onfocus={}>",
    "<body onload={}>",
    "<style>*{{background:url('javascript:{}')}}</style>",
    "<object data='javascript:{}'></object>",
    "<base href='javascript:{}//'>",
    "<meta http-equiv=refresh content='0;url=javascript:{}'>",
    "{{{{constructor.constructor('{}')()}}}}",
    "${{{}}}",
    "]]><script>{}</script>",
    "<math><mtext><style><img src=x onerror={}></style></mtext></math>",
    "<b onmouseover={}>bold</b><br>",
    "%3Cscript%3E{}%3C/script%3E",
)
_WRITTEN: Final[tuple[Callable[[str], str], ...]] = (
    lambda text: text,
    str.swapcase,
    lambda text: text.replace(CALL, "".join(f"&#{ord(letter)};" for letter in CALL)),
    lambda text: text.replace(CALL, "".join(f"&#x{ord(letter):06x}" for letter in CALL)),
    lambda text: text.replace(CALL, f"\\u{ord('k'):04x}{CALL[1:]}"),
    lambda text: text.replace(CALL, f"setTimeout('{CALL}')"),
    lambda text: text.replace(CALL, f"eval(atob('{b64encode(CALL.encode()).decode()}'))"),
    lambda text: text.replace("javascript:", "java&Tab;script&colon;"),
    lambda text: text.replace("<", "<\N{ZERO WIDTH SPACE}").replace("javascript:", "JaVaScRiPt\N{ZERO WIDTH SPACE}:"),
    lambda text: text.replace("<", "\N{FULLWIDTH LESS-THAN SIGN}").replace(">", "\N{FULLWIDTH GREATER-THAN SIGN}"),
    lambda text: text.replace(" ", "/").replace("=", "&#61;"),
    lambda text: "\N{RIGHT-TO-LEFT OVERRIDE}" + text,
    quote,
    lambda text: quote(quote(text)),
    escape,
    lambda text: escape(escape(text)),
    lambda text: text.replace("<", "\\x3c").replace(">", "\\u003e"),
    lambda text: text.replace("<", "<<").replace(">", "//>"),
    lambda text: f"ヤマダ{text}花子",
    lambda text: text.replace("script", "scr<script>ipt"),
)


def hostile(count: int = 500) -> list[str]:
    """Return this many different texts: every form in every spelling, in turns."""
    texts = dict.fromkeys(written(shape.format(CALL)) for written, shape in product(_WRITTEN, _SHAPES))
    return list(texts)[:count]
