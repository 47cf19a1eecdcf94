"""A logo or a text with an address outside the report: the logo is refused, and a report fetches nothing."""

import base64
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import pytest

from kata.database.engine import Database
from kata.reporting import letterhead, rendering
from kata.reporting.letterhead import Letterhead, LetterheadError
from kata.reporting.rendering import PrintOptions
from tests.support.reports import AT, contents
from tests.support.service import running
from tests.support.treatment import Texts

_SVG: Final = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 9 9">{}</svg>'
_HTML: Final = 'xmlns:h="http://www.w3.org/1999/xhtml"'
_INNER: Final = base64.b64encode(
    _SVG.format('<image href="http://127.0.0.1/" width="9" height="9"/>').encode()
).decode()
_CONTENT: Final = (
    '<image href="ADDRESS" width="9" height="9"/>',
    '<image href=" ADDRESS" width="9" height="9"/>',
    '<image href="//169.254.169.254/latest" width="9" height="9"/>',
    '<image href="file:///etc/hostname" width="9" height="9"/>',
    '<use href="ADDRESS#a"/>',
    '<style>@import url("ADDRESS");</style>',
    '<style>@\\69mport "ADDRESS";</style>',
    "<style>rect { fill: url(ADDRESS#a) }</style><rect width='5' height='5'/>",
    "<style>rect { fill: UR<![CDATA[L(]]>'ADDRESS#a') }</style><rect width='5' height='5'/>",
    "<style>@font-face { font-family: x; src: url(ADDRESS) } text { font-family: x }</style><text y='5'>a</text>",
    '<rect width="5" height="5" style="fill: url(ADDRESS#a)"/>',
    '<rect width="5" height="5" filter="url( &quot;ADDRESS#a&quot;)"/>',
    '<g xml:base="ADDRESS"><image href="#x" width="3" height="3"/></g>',
    f'<image width="9" height="9" href="data:image/svg+xml;base64,{_INNER}"/>',
    '<image width="9" height="9" href="#y"><animate attributeName="href" values="ADDRESS"/></image>',
    f'<h:img {_HTML} src="ADDRESS"/>',
    f'<h:iframe {_HTML} srcdoc="x"/>',
    f"<s:SCRIPT {_HTML.replace(':h', ':s')}>1</s:SCRIPT>",
    '<rect onclick="x"/>',
    '<a href="javascript:1">x</a>',
    "<foreignObject/>",
    "<g>" * 5000 + "</g>" * 5000,
    "".join(f'<g id="a{n}">' + f'<use href="#a{n + 1}"/>' * 10 + "</g>" for n in range(9)) + '<g id="a9"/>',
)
_WHOLE: Final = (
    '<?xml-stylesheet href="ADDRESS" type="text/css"?>' + _SVG.format(""),
    '<!DOCTYPE svg [<!ENTITY a SYSTEM "file:///etc/hostname">]>' + _SVG.format("<text>&a;</text>"),
    '<!DOCTYPE svg SYSTEM "ADDRESS">' + _SVG.format(""),
    f"<!DOCTYPE svg [<!ENTITY a '{'a' * 1000}'><!ENTITY b '{'&a;' * 1000}'><!ENTITY c '{'&b;' * 1000}'>]>"
    + _SVG.format("<text>&c;</text>"),
)
HOSTILE: Final = (*(_SVG.format(content) for content in _CONTENT), *_WHOLE)


class _Server:
    """A server to which an attacker wants a request to be sent."""

    def __init__(self) -> None:
        self.listening = socket.create_server(("127.0.0.1", 0))
        self.listening.settimeout(0.2)
        self.address = f"http://127.0.0.1:{self.listening.getsockname()[1]}/secret"

    def was_asked(self) -> bool:
        try:
            self.listening.accept()[0].close()
        except TimeoutError:
            return False
        return True


@pytest.fixture
def server() -> Iterator[_Server]:
    made = _Server()
    yield made
    made.listening.close()


@pytest.mark.parametrize("number", range(len(HOSTILE)))
def test_a_logo_with_something_outside_it_is_refused(tmp_path: Path, server: _Server, number: int) -> None:
    logo = tmp_path / "logo.svg"
    logo.write_text(HOSTILE[number].replace("ADDRESS", server.address))
    with pytest.raises(LetterheadError, match=r"is an SVG (with|whose)|neither PNG nor SVG"):
        letterhead.read("", "", "", logo)
    assert not server.was_asked()


def test_service_starts_without_a_logo_that_it_refuses(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    logo = tmp_path / "logo.svg"
    logo.write_text(HOSTILE[0].replace("ADDRESS", "http://127.0.0.1:9"))
    with running(tmp_path, simulate=False, clinic_name="Midori Clinic", clinic_logo=logo) as client:
        app: Any = client.app
        head = app.state.services.letterhead
    assert (head.name, head.logo) == ("Midori Clinic", "")
    assert "Reports are printed without a logo." in caplog.text


def test_a_drawing_of_a_usual_program_is_accepted(tmp_path: Path) -> None:
    logo = tmp_path / "logo.svg"
    logo.write_text(
        """<?xml version="1.0"?><svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"
        xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape" viewBox="0 0 9 9" inkscape:version="1.3">
        <inkscape:grid/><defs><linearGradient id="a"><stop stop-color="#fff"/></linearGradient><path id="b" d="M0 0h3"/></defs>
        <style>.c { fill: url(#a) }</style><g style="fill: url('#a')"><rect width="3" height="3"/></g><use xlink:href="#b"/></svg>"""
    )
    assert letterhead.read("", "", "", logo).logo


@pytest.mark.campaign
def test_a_report_fetches_nothing_even_with_a_hostile_logo(sqlite: Database, server: _Server, tmp_path: Path) -> None:
    """Skip the check of the logo."""
    secret = tmp_path / "secret.svg"
    secret.write_text(_SVG.format("<text y='5'>canary</text>"))
    _, care = contents(sqlite)
    for address in (server.address, secret.as_uri()):
        for content in _CONTENT[:16]:
            image = base64.b64encode(_SVG.format(content).replace("ADDRESS", address).encode()).decode()
            head = Letterhead(logo=f"data:image/svg+xml;base64,{image}")
            assert b"canary" not in rendering.episode_pdf(care, PrintOptions(head, "en", "", AT))
    assert not server.was_asked()


def test_texts_that_look_like_markup_fetch_nothing(sqlite: Database, server: _Server) -> None:
    there = server.address
    text = f"</td><img src={there}><link rel=stylesheet href={there}><style>@import '{there}'</style>"
    hostile = Texts(text[:100], text[:100], text[:100], text, text[:100], text)
    visit, care = contents(sqlite, hostile)
    how = PrintOptions(Letterhead(text, (text,), text), "en", "", AT)
    for page in (rendering.session_page(visit, how), rendering.episode_page(care, how)):
        assert "&lt;img src=" in page.html
        assert "<img" not in page.html
        assert "<link" not in page.html
        assert page.policy.startswith("default-src 'none'; ")
    rendering.session_pdf(visit, how)
    rendering.episode_pdf(care, how)
    assert not server.was_asked()
