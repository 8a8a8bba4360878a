"""The site of the documentation: it is built without a warning, loads nothing, and reports links that lead nowhere."""

import re
from pathlib import Path

import pytest

from support.checkers import checked, found

TOP = Path(__file__).parents[2]

PAGE = """\
# Page

[Models](../examples/line_follower/line_follower.rscd), [robots](../examples/README.md), [names](glossary.md),
[nothing](../nothing.md), [no page](nowhere.md), [no section](#nowhere).

![A picture](https://pictures.example/robot.png)

```robosc file=shop.rscd add
robot R { }
```
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    checked("mkdocs", "build", "--strict", "--site-dir", folder)
    return folder


def test_the_site_has_every_page(site: Path) -> None:
    names = {path.stem for path in (TOP / "docs").glob("*.md")} - {"README"}
    assert [name for name in sorted(names) if not (site / f"{name}.html").exists()] == []
    assert (site / "repository" / "bridge" / "index.html").exists()


def test_nothing_is_loaded_from_another_server(site: Path) -> None:
    texts = {path.relative_to(site): path.read_text("utf-8") for path in site.rglob("*.html")}
    loaded = [
        (str(path), tag)
        for path, text in texts.items()
        for tag in re.findall(r"<(?:script|link|img)\b[^>]*>", text)
        if re.search(r"""(?:src|href)=["']?(?:https?:)?//""", tag)
    ]
    assert loaded == []
    styles = [path.read_text("utf-8") for path in site.rglob("*.css")]
    assert [style for style in styles if re.search(r"url\([\"']?https?:|@import", style)] == []


def test_what_leads_nowhere_is_found(tmp_path: Path) -> None:
    found("mkdocs")
    docs = tmp_path / "docs"
    docs.mkdir()
    (docs / "index.md").write_text(PAGE, "utf-8")
    (docs / "glossary.md").write_text("# Names\n", "utf-8")
    settings = f"INHERIT: {TOP / 'mkdocs.yml'}\ndocs_dir: docs\nhooks: ['{TOP / 'deploy' / 'site_hooks.py'}']\n"
    settings += "nav: [index.md, glossary.md]\nextra: {repository_pages: [examples/README.md]}\nextra_css: []\n"
    (tmp_path / "mkdocs.yml").write_text(settings, "utf-8")
    said = checked("mkdocs", "build", "--no-strict", "--site-dir", tmp_path / "site", folder=tmp_path)
    wanted = (
        "there is no nothing.md",
        "'nowhere.md', but the target is not found",
        "'#nowhere', but there is no such anchor",
        "loads something from another server",
        'not included in the "nav" configuration',
    )
    assert [word for word in wanted if word not in said] == [], said
    assert said.count("WARNING -") == len(wanted), said
    text = (tmp_path / "site" / "index.html").read_text("utf-8")
    assert "Models (<code>examples/line_follower/line_follower.rscd</code>)" in text
    assert 'href="repository/examples/index.html"' in text and '<span class="filename">shop.rscd</span>' in text
    assert '<span class="k">robot</span>' in text
