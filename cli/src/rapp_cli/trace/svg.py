"""A run as SVG, drawn without a browser: lifelines side by side, time runs downwards."""

from collections.abc import Sequence
from xml.etree import ElementTree

from rapp_cli.trace.layout import BAR, GAP, HEAD, LINE, TOP, Layout, Row, head_width, lay_out, text_width
from rapp_cli.trace.messages import Item
from rapp_cli.trace.participants import NAMES

STYLE = """
text { font: 12px "DejaVu Sans", Verdana, system-ui, sans-serif; fill: #1f2430; text-anchor: middle }
text.title { font-size: 16px; font-weight: 600; text-anchor: start } text.name { font-weight: 600 }
text.small { font-size: 10px; fill: #667085; text-anchor: start }
.paper { fill: #ffffff } .halo { fill: #ffffff; opacity: .8 } .head { fill: #e8eefc; stroke: #4565b8 }
.life { stroke: #98a2b3; stroke-dasharray: 3 4 } .bar { fill: #d5def5; stroke: #4565b8 }
.note { fill: #fff8db; stroke: #c8a92d } .state { fill: #eaf6ec; stroke: #4d9a5b }
.wire { stroke: #1f2430; fill: none; stroke-width: 1.2 } .reply { stroke-dasharray: 6 4 } .full { fill: #1f2430 }
@media (prefers-color-scheme: dark) {
text { fill: #e6e9ef } text.small { fill: #98a2b3 } .paper, .halo { fill: #14171d } .head { fill: #24345f; stroke: #8fa8ea }
.life { stroke: #667085 } .bar { fill: #2f447c; stroke: #8fa8ea } .note { fill: #4a4013; stroke: #cdb24a }
.state { fill: #1c3f25; stroke: #6fbd7e } .wire { stroke: #e6e9ef } .full { fill: #e6e9ef }
}
"""
LEGEND = (("call", "synchronous"), ("send", "asynchronous"), ("reply", "reply"))
LEGEND_STEP = 150  # px
TALL = 900  # px of lifelines that have their names at the lower end, too
HEAD_LENGTH, HEAD_HALF = 9, 4.5  # of an arrow


def to_svg(items: Sequence[Item], title: str) -> str:
    """One well-formed document, readable on a light and on a dark ground."""
    layout = lay_out(items)
    heads = [TOP - HEAD - GAP] + ([layout.bottom] if layout.bottom - TOP > TALL else [])
    legend = max(layout.bottom, heads[-1] + HEAD) + 1.5 * GAP
    width, height = max(layout.width, LEGEND_STEP * len(LEGEND) + GAP, 9.5 * len(title) + 2 * GAP), legend + 2 * GAP
    drawing = _Drawing(width, height, title)
    drawing.text(title, GAP, 28, "title")
    _lifelines(drawing, layout, heads)
    for bar in layout.bars:
        drawing.box(layout.columns[bar.name] - BAR + 4 * bar.depth, bar.top, 2 * BAR, bar.bottom - bar.top, "bar")
    begin = items[0].time if items else 0.0
    for row in layout.rows:
        drawing.text(f"{row.item.time - begin:.2f} s", GAP, row.y, "small")
        (_note if row.item.source == row.item.target else _arrow)(drawing, row, layout)
    for index, (kind, words) in enumerate(LEGEND):
        x = GAP + index * LEGEND_STEP
        drawing.arrow(kind, x, x + 32, legend)
        drawing.text(words, x + 40, legend + 4, "small")
    return drawing.document()


def _lifelines(drawing: "_Drawing", layout: Layout, tops: Sequence[float]) -> None:
    for name, x in layout.columns.items():
        drawing.line(x, tops[0] + HEAD, x, layout.bottom, "life")
        for top in tops:
            width = head_width(name)
            drawing.box(x - width / 2, top, width, HEAD, "head", 4)
            drawing.text(NAMES.get(name, name), x, top + HEAD / 2 + 4, "name")


def _note(drawing: "_Drawing", row: Row, _layout: Layout) -> None:
    height = LINE * len(row.lines) + 6
    radius = 9 if row.item.kind == "state" else 0
    drawing.box(row.left, row.y - height + 4, row.right - row.left, height, row.item.kind, radius)
    drawing.lines(row.lines, (row.left + row.right) / 2, row.y - 3)


def _arrow(drawing: "_Drawing", row: Row, layout: Layout) -> None:
    middle = (row.left + row.right) / 2
    drawing.halo(row.lines, middle, row.y - 5)
    drawing.lines(row.lines, middle, row.y - 5)
    rightwards = layout.columns[row.item.source] < layout.columns[row.item.target]
    source, target = (row.left, row.right) if rightwards else (row.right, row.left)
    drawing.arrow(row.item.kind, source, target, row.y)


class _Drawing:
    """Shapes in a document."""

    def __init__(self, width: float, height: float, title: str) -> None:
        size = {"width": f"{width:.0f}", "height": f"{height:.0f}", "viewBox": f"0 0 {width:.0f} {height:.0f}"}
        self._root = ElementTree.Element("svg", {"xmlns": "http://www.w3.org/2000/svg", "role": "img", **size})
        ElementTree.SubElement(self._root, "title").text = title
        ElementTree.SubElement(self._root, "style").text = STYLE
        self.box(0, 0, width, height, "paper")

    def document(self) -> str:
        """The document as text."""
        ElementTree.indent(self._root)
        return ElementTree.tostring(self._root, encoding="unicode") + "\n"

    def box(self, x: float, y: float, width: float, height: float, kind: str, radius: float = 0) -> None:
        """A rectangle."""
        self._add("rect", kind, x=x, y=y, width=width, height=height, rx=radius)

    def line(self, x1: float, y1: float, x2: float, y2: float, kind: str) -> None:
        """A straight line."""
        self._add("line", kind, x1=x1, y1=y1, x2=x2, y2=y2)

    def text(self, words: str, x: float, y: float, kind: str = "") -> None:
        """One line of text."""
        self._add("text", kind, x=x, y=y).text = words

    def lines(self, lines: Sequence[str], x: float, bottom: float) -> None:
        """Several lines of text, the last one at `bottom`."""
        for index, words in enumerate(reversed(lines)):
            self.text(words, x, bottom - LINE * index)

    def halo(self, lines: Sequence[str], x: float, bottom: float) -> None:
        """A ground for several lines of text that may cross lifelines."""
        width = max(map(text_width, lines)) * 0.9
        self.box(x - width / 2, bottom - LINE * len(lines) + 3, width, LINE * len(lines), "halo")

    def arrow(self, kind: str, source: float, target: float, y: float) -> None:
        """A full head for a call, an open one for what is asynchronous, an open one on a dashed line for a reply."""
        back = target - HEAD_LENGTH if target > source else target + HEAD_LENGTH
        self.line(source, y, target, y, f"wire {kind}")
        head = f"{back:g},{y - HEAD_HALF:g} {target:g},{y:g} {back:g},{y + HEAD_HALF:g}"
        shape, look = ("polygon", "full") if kind == "call" else ("polyline", "wire")
        ElementTree.SubElement(self._root, shape, {"class": look, "points": head})

    def _add(self, shape: str, kind: str, **numbers: float) -> ElementTree.Element:
        fields = {name: f"{round(value, 1):g}" for name, value in numbers.items()}
        return ElementTree.SubElement(self._root, shape, {"class": kind, **fields} if kind else fields)
