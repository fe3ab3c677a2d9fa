"""What `make docs` does beside MkDocs: pages from the root of the repository, and links that lead out of `docs/`.

CONTRIBUTING.md, CHANGELOG.md and SECURITY.md stay where a visitor of the repository looks for them, and are pages of
the site, too. A link to any other file outside of `docs/` becomes its path as text.
"""

import posixpath
import re
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File

ROOT = Path(__file__).parents[1]
PAGES = {"CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md", "SECURITY.md": "security.md"}
"""Pages of the site by files of the root."""
REQUEST = re.compile(r"""<(?:script|img|iframe|source|link)\b[^>]*\b(?:src|href)=["']https?:""")
"""What a browser would fetch from elsewhere."""
LINK = re.compile(r"\[([^\]]*)\]\(([^)#\s:]+)((?:#[^)\s]*)?)\)")


def on_files(files: Any, config: Any) -> Any:
    """Add the pages of the root."""
    for name, page in PAGES.items():
        files.append(File.generated(config, page, content=(ROOT / name).read_text(encoding="utf-8")))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Mend links by where the page really lies."""
    source = page.file.src_uri
    roots = {page: name for name, page in PAGES.items()}
    at = posixpath.dirname(roots.get(source, f"docs/{source}"))

    def mended(link: re.Match[str]) -> str:
        text, target, part = link.groups()
        path = posixpath.normpath(posixpath.join(at, target))
        inside = PAGES.get(path) or (path.removeprefix("docs/") if path.startswith("docs/") else "")
        if not inside:
            return f"{text} (`{path}`)"
        return f"[{text}]({posixpath.relpath(inside, posixpath.dirname(source) or '.')}{part})"

    return LINK.sub(mended, markdown)


def on_post_build(config: Any) -> None:
    """Refuse a site that would fetch something from elsewhere."""
    for path in Path(config["site_dir"]).rglob("*.html"):
        found = REQUEST.search(path.read_text(encoding="utf-8"))
        if found and 'rel="canonical"' not in found[0]:
            raise SystemExit(f"{path}: would be fetched from elsewhere: {found[0]}")
