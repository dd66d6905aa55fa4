"""What is wrong with an HTML page, by its own style sheet."""

import re
from html.parser import HTMLParser

VOID = {"meta", "img", "br"}
IN_PARAGRAPHS = {"a", "b", "br", "code", "i", "img", "span", "sub", "sup"}
ATTRIBUTES = {"charset", "class", "content", "id", "lang", "name"}
OF_TAG = {"img": {"alt", "src"}, "td": {"colspan"}, "th": {"colspan", "rowspan"}}


class Page(HTMLParser):
    """Parses a page; `faults` holds what is wrong with it, `classes` all pairs of tag and class on it."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.faults: list[str] = []
        self.classes: set[tuple[str, str]] = set()
        self.ids: set[str] = set()
        self.feed(text)
        self.close()
        style = "".join(re.findall(r"<style>(.*?)</style>", text, re.S))
        selectors = ",".join(re.findall(r"([^{}]+)\{", style)).replace(",", " ").split()
        known = {tuple(s.rsplit(".", 1)) for s in selectors if "." in s}
        self.faults += [
            f"<{t} class={c!r}> is not in the style sheet" for t, c in self.classes if not {(t, c), ("", c)} & known
        ]
        self.faults += [f"<{tag}> is not closed" for tag in self.open if tag != "html"]

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        if "p" in self.open and tag not in IN_PARAGRAPHS:
            self.faults.append(f"<{tag}> in a paragraph")
        if tag not in VOID:
            self.open.append(tag)
        for name, value in attributes:
            if name not in ATTRIBUTES | OF_TAG.get(tag, set()):
                self.faults.append(f"<{tag}> has the attribute {name}")
            if not value or (name == "src" and not value.startswith("data:")):
                self.faults.append(f"<{tag} {name}={value!r}>")
            if name == "class":
                self.classes |= {(tag, word) for word in (value or "").split(" ")}
            if name == "id":
                self.faults += [f"id {value} twice"] * (value in self.ids)
                self.ids.add(value or "")

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.faults.append(f"</{tag}> closes another element")
