"""How the page looks beyond what its library offers: title, icon, and a style of its own."""

from __future__ import annotations

import re
from urllib.parse import quote

TITLE = "HMCS"
_ICON = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32">'
    '<rect width="32" height="32" rx="7" fill="#0072B2"/>'
    '<path d="M4 24C10 24 10 8 16 8s6 16 12 16" fill="none" stroke="#E69F00" stroke-width="7" '
    'stroke-linecap="round" opacity=".55"/>'
    '<path d="M4 24C10 24 10 8 16 8s6 16 12 16" fill="none" stroke="#fff" stroke-width="2.5" '
    'stroke-linecap="round"/></svg>'
)
_STYLE = """
/* Tabs keep their places whichever of them is open. */
[data-dock-area] [data-dock-strip][role=tablist], .mantine-Tabs-list {
  display: grid !important; grid-template-columns: repeat(4, auto);
  justify-content: stretch !important;
}
[data-dock-area] [data-dock-strip] > [role=tab], .mantine-Tabs-tab {
  font-weight: 500 !important; justify-content: center; padding: 0 0.2em !important;
}
.mantine-Tabs-tab { min-height: 2.4em; }
/* A word is not broken where it stands before its field. */
label {
  overflow-wrap: normal !important; word-break: normal !important; font-size: 0.85em !important;
}
/* The ends of a slider are read whole. */
.multi-slider-mark-wrapper:last-of-type .multi-slider-mark-label { right: 0; }
/* The legend names curves; the axis names the time. */
.u-legend .u-series:first-child { display: none; }
.mantine-Table-table { font-size: 12px !important; }
.mantine-Table-table th, .mantine-Table-table td {
  padding: 0.2em 0.5em !important; text-align: left; vertical-align: top; overflow-wrap: anywhere;
}
/* On a telephone the panel lies below the arm. */
@media (max-width: 36em) {
  .mantine-Paper-root[style*="fixed"][style*="bottom: 0"] {
    width: 100% !important; max-height: 40% !important;
  }
  .mantine-Paper-root[style*="fixed"][style*="bottom: 0"] [style*="width: 20em"] {
    width: 100% !important;
  }
}
"""
_LINK = re.compile(rb'<link\s+rel="icon".*?/>', re.DOTALL)
_NAME = re.compile(rb"<title>.*?</title>", re.DOTALL)


def with_appearance(page: bytes) -> bytes:
    """Return the library's page with the title, the icon and the style of this product."""
    icon = f'<link rel="icon" href="data:image/svg+xml,{quote(_ICON)}" />'
    head = f"<title>{TITLE}</title>{icon}<style>{_STYLE}</style>"
    return _NAME.sub(lambda _: head.encode(), _LINK.sub(b"", page, count=1), count=1)
