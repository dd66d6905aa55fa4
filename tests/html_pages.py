"""What is wrong with an HTML page, by its own style sheet, and the data that it carries."""

import base64
import gzip
import json
import re
from html.parser import HTMLParser
from typing import Any

import numpy as np

VOID = {"meta", "img", "br", "link"}
IN_PARAGRAPHS = {"a", "b", "br", "code", "i", "img", "span", "sub", "sup"}
ATTRIBUTES = {"aria-hidden", "aria-label", "charset", "class", "content", "id", "lang", "name", "role", "tabindex"}
OF_TAG = {
    "div": {"data-chart"},
    "img": {"alt", "src"},
    "link": {"href", "rel"},
    "output": {"data-line"},
    "script": {"type"},
    "td": {"colspan", "style"},
    "th": {"colspan", "rowspan", "scope"},
}
DRAWING = {"svg", "path", "line", "rect", "circle", "text", "title", "tspan"}  # any attribute of SVG


def charts(page: str) -> list[dict[str, Any]]:
    """The charts whose data a report carries, in their order, with arrays in place of their numbers."""
    content = re.search(r'<script type="text/plain" id="data">(.*?)</script>', page, re.S)
    assert content is not None
    data = gzip.decompress(base64.b64decode(content.group(1)))
    size = int.from_bytes(data[:4], "little")
    header, at, arrays = json.loads(data[4 : 4 + size]), 4 + size, []
    for n in header["lengths"]:
        shuffled = np.frombuffer(data, np.uint8, 8 * n, at).reshape(8, n)
        arrays.append(np.ascontiguousarray(shuffled.T).view("<f8").ravel())
        at += 8 * n
    assert at == len(data)
    for chart in header["charts"]:
        for line in [*chart.get("lines", []), *([chart["ground"]] if "ground" in chart else [])]:
            line |= {key: arrays[line[key]] for key in ("x", "y", "values") if key in line}
        for row in chart.get("rows", []):
            row["modes"] = arrays[row["modes"]]
    figures = re.findall(r"<figure class=\"chart\"><figcaption><b>(.*?)</b>(.*?)</figure>", page, re.S)
    found = ((title, re.search(r"data-chart=\"(\d+)\"", rest)) for title, rest in figures)
    titles = [(title, place.group(1)) for title, place in found if place is not None]
    return [header["charts"][int(k)] | {"title": title} for title, k in titles]


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
        selectors = re.findall(r"([^{}]+)\{", style)
        parts = [part.split(":")[0].split(".") for part in re.split(r"[\s,>]+", ",".join(selectors))]
        known = {(tag, word) for tag, *words in parts for word in words}
        self.faults += [f"<{t} class={c!r}> is not in the style sheet" for t, c in self.classes if not {(t, c), ("", c)} & known]
        self.faults += [f"<{tag}> is not closed" for tag in self.open if tag != "html"]

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        if "p" in self.open and tag not in IN_PARAGRAPHS:
            self.faults.append(f"<{tag}> in a paragraph")
        if tag not in VOID:
            self.open.append(tag)
        for name, value in attributes:
            if name not in ATTRIBUTES | OF_TAG.get(tag, set()) and tag not in DRAWING:
                self.faults.append(f"<{tag}> has the attribute {name}")
            if not value or (name in ("src", "href") and not value.startswith("data:")):
                self.faults.append(f"<{tag} {name}={value!r}>")
            if name == "class":
                self.classes |= {(tag, word) for word in (value or "").split(" ")}
            if name == "id":
                self.faults += [f"id {value} twice"] * (value in self.ids)
                self.ids.add(value or "")

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.faults.append(f"</{tag}> closes another element")
