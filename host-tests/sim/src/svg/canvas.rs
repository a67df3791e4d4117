//! SVG markup: shapes and text in the styles of the picture.

use core::fmt::Write as _;

/// Style sheet with a single sans-serif family, so that no font has to be embedded.
const STYLE: &str = "\
text{font-family:Helvetica,Arial,'DejaVu Sans',sans-serif;font-size:10px;fill:#222;text-anchor:middle}\
.title{font-size:13px;font-weight:bold}.subtitle{font-size:12px}.axis{font-size:11px}\
.start{text-anchor:start}.end{text-anchor:end}.node{font-size:9px;fill:#555}.bold{font-weight:bold}\
.halo{stroke:#fff;stroke-width:2.5px;stroke-linejoin:round;paint-order:stroke}\
line,path{fill:none;stroke:#222;stroke-width:1px}\
.grid{stroke:#e4e4e4}.leader{stroke:#999;stroke-width:.6px}.hop{stroke-linecap:round}\
.relay{fill:#fff;stroke:#222}.lost{fill:#ddd}.cross{stroke:#222;stroke-width:1.6px}\
.ground{fill:#222}.source{fill:#cc79a7;stroke:#222;stroke-width:.8px}\
.beside{fill:#fff;stroke:#cc79a7;stroke-width:2px}\
.before{fill:#fff;stroke:#cc79a7;stroke-width:.8px;stroke-dasharray:2 1.5}.faint{fill:#888}";

/// Point in picture units; y points downward.
pub(super) type Point = (f64, f64);

pub(super) struct Canvas {
    out: String,
}

impl Canvas {
    pub(super) fn new(width: f64, height: f64) -> Self {
        let mut canvas = Self { out: String::new() };
        canvas.put(format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
             height=\"{height}\" role=\"img\">\n"
        ));
        canvas
    }

    /// Writes the title, the style sheet and the white background.
    pub(super) fn describe(&mut self, words: &str) {
        let words = escape(words);
        self.put(format_args!(
            "<title>{words}</title>\n<style>{STYLE}</style>\n"
        ));
        self.put(format_args!(
            "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
        ));
    }

    pub(super) fn finish(mut self) -> String {
        self.out.push_str("</svg>\n");
        self.out
    }

    pub(super) fn line(&mut self, (x1, y1): Point, (x2, y2): Point, class: &str) {
        let [x1, y1, x2, y2] = [x1, y1, x2, y2].map(short);
        self.put(format_args!(
            "<line class=\"{class}\" x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\"/>\n"
        ));
    }

    /// Draws a line with its own colour and width, optionally dashed, with a tooltip.
    pub(super) fn hop(
        &mut self,
        [(x1, y1), (x2, y2)]: [Point; 2],
        (colour, width): (&str, f64),
        dashed: bool,
        tip: &str,
    ) {
        let [x1, y1, x2, y2, width] = [x1, y1, x2, y2, width].map(short);
        let dash = if dashed { ";stroke-dasharray:3 4" } else { "" };
        let tip = escape(tip);
        self.put(format_args!(
            "<line class=\"hop\" x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\" \
             style=\"stroke:{colour};stroke-width:{width}px{dash}\"><title>{tip}</title></line>\n"
        ));
    }

    pub(super) fn edge(&mut self, (x1, y1): Point, (x2, y2): Point) {
        let [x1, y1, x2, y2] = [x1, y1, x2, y2].map(short);
        self.put(format_args!(
            "<line class=\"edge\" x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\" \
             style=\"stroke:#009e73;stroke-dasharray:6 3\"/>\n"
        ));
    }

    /// Draws a sample of a hop's line in the legend.
    pub(super) fn swatch(&mut self, (x, y): Point, length: f64, (colour, width): (&str, f64)) {
        let [x, y, end, width] = [x, y, x + length, width].map(short);
        self.put(format_args!(
            "<line class=\"swatch\" x1=\"{x}\" y1=\"{y}\" x2=\"{end}\" y2=\"{y}\" \
             style=\"stroke:{colour};stroke-width:{width}px\"/>\n"
        ));
    }

    pub(super) fn shape(&mut self, points: &[Point], class: &str) {
        let outline = outline(points);
        self.put(format_args!("<path class=\"{class}\" d=\"{outline}\"/>\n"));
    }

    pub(super) fn marked(&mut self, points: &[Point], class: &str, tip: &str) {
        let (outline, tip) = (outline(points), escape(tip));
        self.put(format_args!(
            "<path class=\"{class}\" d=\"{outline}\"><title>{tip}</title></path>\n"
        ));
    }

    /// Draws a relay with a tooltip. Only relays are circles, so tests can count them.
    pub(super) fn relay(
        &mut self,
        (x, y): Point,
        (radius, rim): (f64, f64),
        class: &str,
        tip: &str,
    ) {
        let [x, y, radius, rim] = [x, y, radius, rim].map(short);
        let tip = escape(tip);
        self.put(format_args!(
            "<circle class=\"{class}\" cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" style=\"stroke-width:{rim}px\">\
             <title>{tip}</title></circle>\n"
        ));
    }

    /// Draws a relay symbol for the legend, as a path instead of a circle.
    pub(super) fn disc(&mut self, (x, y): Point, radius: f64, class: &str) {
        let [x, y, r] = [x - radius, y, radius].map(short);
        let turn = short(2.0 * radius);
        self.put(format_args!(
            "<path class=\"{class}\" d=\"M{x} {y}a{r} {r} 0 1 0 {turn} 0a{r} {r} 0 1 0 -{turn} 0Z\"/>\n"
        ));
    }

    pub(super) fn text(&mut self, (x, y): Point, class: &str, words: &str) {
        let [x, y] = [x, y].map(short);
        let words = escape(words);
        self.put(format_args!(
            "<text class=\"{class}\" x=\"{x}\" y=\"{y}\">{words}</text>\n"
        ));
    }

    /// Writes a symbol with a subscript and further text.
    pub(super) fn subscripted(
        &mut self,
        (x, y): Point,
        class: &str,
        (symbol, index, rest): (&str, &str, &str),
    ) {
        let [x, y] = [x, y].map(short);
        let [symbol, index, rest] = [symbol, index, rest].map(escape);
        self.put(format_args!(
            "<text class=\"{class}\" x=\"{x}\" y=\"{y}\">{symbol}<tspan dy=\"3\" font-size=\"9\">{index}</tspan>\
             <tspan dx=\"4\" dy=\"-3\">{rest}</tspan></text>\n"
        ));
    }

    /// Writes text that reads upward.
    pub(super) fn upward(&mut self, (x, y): Point, class: &str, words: &str) {
        let [x, y] = [x, y].map(short);
        let words = escape(words);
        self.put(format_args!(
            "<text class=\"{class}\" transform=\"translate({x} {y}) rotate(-90)\">{words}</text>\n"
        ));
    }

    fn put(&mut self, markup: core::fmt::Arguments<'_>) {
        // Writing to a `String` cannot fail.
        let _ = self.out.write_fmt(markup);
    }
}

/// Returns the path data of a closed polygon.
fn outline(points: &[Point]) -> String {
    let mut data = String::new();
    for (index, (x, y)) in points.iter().enumerate() {
        let step = if index == 0 { 'M' } else { 'L' };
        let _ = write!(data, "{step}{} {}", short(*x), short(*y));
    }
    data + "Z"
}

/// Rounds a coordinate to hundredths; non-finite values become 0.
fn short(value: f64) -> f64 {
    let hundredths = (100.0 * value).round();
    // The addition turns -0 into 0.
    if hundredths.is_finite() {
        hundredths / 100.0 + 0.0
    } else {
        0.0
    }
}

/// Escapes text for XML; characters that XML 1.0 excludes are replaced.
fn escape(words: &str) -> String {
    let mut out = String::with_capacity(words.len());
    for c in words.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}
