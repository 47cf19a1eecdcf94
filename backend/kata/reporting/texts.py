"""Messages about reports."""

from typing import Final

from kata.messages import message

NO_PRINTING: Final = message(
    "no_printing", "This computer cannot make PDF files, because the package plutoprint is not installed."
)
PRINT_IN_BROWSER: Final = message("print_in_browser", "Open the report as a page and print it in the browser.")
INSTALL_PLUTOPRINT: Final = message("install_plutoprint", "Install the package plutoprint on the station's computer.")
