"""What the site's navigation shows, in its order: pages by their path from the root."""

from __future__ import annotations

from api_pages import FOLDER, ROOT, name_of, pages, programs

FRONT_PAGE = "README"
WRITTEN = {
    "Use it": (
        "docs/README",
        "docs/teach-your-own-task",
        "docs/operate",
        "docs/recognizers",
        "docs/fixtures",
        "docs/safety",
        "docs/results",
    ),
    "How to": (
        "examples/README",
        "docs/how-to/own-recognizer",
        "docs/how-to/own-fixture",
        "docs/how-to/own-device",
        "docs/how-to/own-robot",
        "docs/how-to/ros2",
        "docs/how-to/own-data",
        "docs/how-to/several-hosts",
        "docs/how-to/closed-cell",
    ),
    "Understand it": (
        "docs/ideas",
        "docs/equations",
        "docs/messages",
        "docs/contract",
        "shared/baselines/hmcs_baselines/hmm/TUTORIAL",
    ),
    "Change it": ("CONTRIBUTING", "CHANGELOG"),
}


def navigation() -> dict[str, list[str]]:
    """Return the captions of the navigation, each with its pages."""
    api = FOLDER.relative_to(ROOT).as_posix()
    run = {name_of(program) for program in programs()}
    return {caption: list(names) for caption, names in WRITTEN.items()} | {
        "API: libraries": [f"{api}/{name}" for name in pages() if name not in run],
        "API: services and commands": [f"{api}/{name}" for name in pages() if name in run],
    }


def front_page_with_navigation(text: str) -> str:
    """Return the text of the front page, Markdown, with the navigation for Sphinx at its end."""
    return text + "".join(
        "\n".join(
            (
                "",
                "```{toctree}",
                ":hidden:",
                f":caption: '{caption}'",
                "",
                *map("/{}".format, names),
            )
        )
        + "\n```\n"
        for caption, names in navigation().items()
    )
