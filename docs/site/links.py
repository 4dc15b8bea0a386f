"""`python links.py FOLDER` checks a built site: inner links lead somewhere, nothing is fetched.

A page may link to the network; what it needs to be shown has to lie in the folder, so that the site
works from the file system.
"""

from __future__ import annotations

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

NEEDED = {"script": "src", "img": "src", "iframe": "src", "link": "href"}
"""Elements that a browser loads with the page, with the attribute that says from where."""


class Page(HTMLParser):
    """The anchors and links of one page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.links: set[str] = set()
        self.needed: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collect what an element declares and refers to."""
        given = dict(attrs)
        self.anchors |= {given[name] or "" for name in ("id", "name") if name in given}
        if tag == "a" and given.get("href"):
            self.links.add(given["href"] or "")
        if tag in NEEDED and given.get(NEEDED[tag]):
            self.needed.add(given[NEEDED[tag]] or "")


def problems(folder: Path) -> list[str]:
    """Return a line for each link that leads nowhere and each thing loaded from elsewhere."""
    pages = {
        path.resolve(): Page(path.read_text(encoding="utf-8")) for path in folder.rglob("*.html")
    }
    found = []
    for path, page in sorted(pages.items()):
        for link in sorted(page.links | page.needed):
            fault = _fault(link, path, page, pages)
            if fault:
                found.append(f"{path.relative_to(folder.resolve())}: {link}: {fault}")
    return found


def _fault(link: str, path: Path, page: Page, pages: dict[Path, Page]) -> str | None:
    parts = urlsplit(link)
    if parts.scheme or parts.netloc:
        return "is loaded from outside the site" if link in page.needed else None
    target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
    if not target.exists():
        return "no such file"
    if parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].anchors:
        return "no such place on the page"
    return None


def main(folder: str) -> int:
    """Print the problems of a site; return 1 where there are any."""
    found = problems(Path(folder))
    print("\n".join(found) or f"The links of {folder} lead somewhere.")
    return 1 if found else 0


if __name__ == "__main__":
    raise SystemExit(main(*sys.argv[1:]))
