"""Runs scripts in a page of a real browser engine (Chromium inside Qt WebEngine), without a screen.

Usage: python headless_browser.py PAGE.html < STEPS.json > REPORT.json

STEPS is a list of [script, milliseconds to wait before the next]. REPORT holds the value of every
script (a number, a text or a truth value), what the page wrote to its console, and the addresses
it asked for. Qt needs a process of its own: its event loop does not end well in a test runner.
"""

import json
import os
import sys
from pathlib import Path

NO_BROWSER = 3
SECONDS = 60

os.environ["QT_QPA_PLATFORM"] = "offscreen"
# Containers have no user namespaces for the sandbox; the page is our own and asks for nothing.
os.environ["QTWEBENGINE_DISABLE_SANDBOX"] = "1"
os.environ["QTWEBENGINE_CHROMIUM_FLAGS"] = "--disable-gpu"

try:
    from PySide6.QtCore import QTimer, QUrl
    from PySide6.QtWebEngineCore import QWebEnginePage, QWebEngineUrlRequestInterceptor
    from PySide6.QtWebEngineWidgets import QWebEngineView
    from PySide6.QtWidgets import QApplication
except ImportError as error:
    print(f"no browser engine: {error}. Install this library of the system.", file=sys.stderr)
    sys.exit(NO_BROWSER)


class Page(QWebEnginePage):
    """A page that keeps what it writes to the console."""

    def __init__(self, parent: QWebEngineView) -> None:
        super().__init__(parent)
        self.console: list[str] = []

    def javaScriptConsoleMessage(self, level, message, line, source) -> None:
        """Called by Qt."""
        self.console.append(f"line {line}: {message}")


class Requests(QWebEngineUrlRequestInterceptor):
    """Keeps every address that is asked for."""

    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[str] = []

    def interceptRequest(self, info) -> None:
        """Called by Qt."""
        self.addresses.append(info.requestUrl().toString())


def run(page_file: Path, steps: list[tuple[str, int]]) -> dict[str, list]:
    """Load the page, run the scripts one after the other, return the report."""
    application = QApplication(sys.argv)
    view, requests, values = QWebEngineView(), Requests(), []
    page = Page(view)
    page.setUrlRequestInterceptor(requests)
    view.setPage(page)
    view.resize(1000, 900)

    def step(number: int) -> None:
        if number == len(steps):
            application.quit()
            return
        script, wait = steps[number]

        def keep(value: object) -> None:
            values.append(value)
            QTimer.singleShot(wait, lambda: step(number + 1))

        page.runJavaScript(script, keep)

    view.loadFinished.connect(lambda _: step(0))
    view.setUrl(QUrl.fromLocalFile(str(page_file)))
    view.show()
    QTimer.singleShot(1000 * SECONDS, application.quit)
    application.exec()
    # In this order, or Qt complains about a profile that is still in use.
    page.deleteLater()
    return {"values": values, "console": page.console, "requests": requests.addresses}


if __name__ == "__main__":
    json.dump(run(Path(sys.argv[1]), json.load(sys.stdin)), sys.stdout)
