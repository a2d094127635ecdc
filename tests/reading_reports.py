"""Parse an HTML report: its whole text, and the text that is visible with all folds closed."""

import re
from html.parser import HTMLParser

VOID = {"meta", "img", "br", "link", "hr"}


class Page(HTMLParser):
    """Texts, links and images of an HTML page; fails if elements are not closed in order."""

    def __init__(self, text):
        super().__init__()
        self.open, self.sources, self.links, self.ids = [], [], [], []
        self.texts, self.seen, self.captions, self.headings, self.found = [], [], [], [], []
        self.is_finding = False
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.sources += [found[key] for key in ("src", "data", "poster") if key in found]
        self.links += [found["href"]] if "href" in found else []
        self.ids += [found["id"]] if "id" in found else []
        if tag not in VOID:
            self.open.append(tag)
        if tag == "figcaption":
            self.captions.append("")
        self.is_finding = found.get("class") == "findings"

    def handle_endtag(self, tag):
        if tag in {"td", "th", "dt", "dd", "li"}:
            self.handle_data(" ")
        assert self.open.pop() == tag
        self.is_finding = False

    def handle_data(self, data):
        if {"style", "title"} & set(self.open):
            return
        self.texts.append(data)
        if self.is_seen:
            self.seen.append(data)
        if "figcaption" in self.open:
            self.captions[-1] += data
        if "th" in self.open and self.is_seen and data.strip():
            self.headings.append(data)
        if self.is_finding:
            self.found.append(data)

    @property
    def is_seen(self):
        """Whether the current text is visible with all folds closed; a fold's summary is visible."""
        if "details" not in self.open:
            return True
        return self.open[self.open.index("details") + 1 :][:1] == ["summary"]

    @property
    def text(self):
        return _line(self.texts)

    @property
    def visible(self):
        return _line(self.seen)

    @property
    def findings(self):
        return _line(self.found)


def _line(texts):
    return re.sub(r"\s+", " ", "".join(texts)).strip()
