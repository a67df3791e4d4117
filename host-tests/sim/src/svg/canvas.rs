//! SVG markup: shapes and text in the styles of the picture.

use core::fmt::Write as _;

/// Style sheet of the pictures. It names only usual sans-serif fonts, so that no font has to be embedded.
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

/// Point (x, y) in picture units; y points downward.
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

    /// Writes the beginning of the document: the style sheet, the white background, and the title `words`.
    ///
    /// Screen readers read the title.
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

    /// Draws the line of a hop between two points, with its colour and width and a tooltip `tip`.
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

    /// Draws a short sample of a hop's line in the legend, from (`x`, `y`) to the right, `length` long.
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

    /// Draws a relay as a circle with a tooltip. No symbol of any other object is a circle, so that tests can count
    /// relays.
    ///
    /// `rim` is the width of the outline.
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

    /// Draws the symbol of a relay, or a dot, as a path. It is a path and not a circle, because tests count circles as
    /// relays.
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

    /// Writes a text that begins with a symbol and its subscript, `index`.
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

    /// Writes text that is rotated to read from bottom to top.
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

/// Returns the data of an SVG path: the closed polygon through `points`.
fn outline(points: &[Point]) -> String {
    let mut data = String::new();
    for (index, (x, y)) in points.iter().enumerate() {
        let step = if index == 0 { 'M' } else { 'L' };
        let _ = write!(data, "{step}{} {}", short(*x), short(*y));
    }
    data + "Z"
}

/// Rounds a coordinate to two decimals. Values that are not finite become 0.
fn short(value: f64) -> f64 {
    let hundredths = (100.0 * value).round();
    // The addition turns -0 into 0.
    if hundredths.is_finite() {
        hundredths / 100.0 + 0.0
    } else {
        0.0
    }
}

/// Escapes text for XML. Characters that XML 1.0 excludes, such as control characters, are replaced by U+FFFD.
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

/// Linear scale from a quantity, such as a distance in metres, to a coordinate of the picture.
#[derive(Clone, Copy)]
pub(super) struct Scale {
    from: (f64, f64),
    to: (f64, f64),
}

/// Scales of a plot's two axes.
///
/// `x` is along the line from Tx to Rx. `h` is the height or, in the view from above, the lateral offset.
pub(super) struct Frame {
    pub(super) x: Scale,
    pub(super) h: Scale,
}

impl Scale {
    pub(super) const fn new(from: (f64, f64), to: (f64, f64)) -> Self {
        Self { from, to }
    }

    /// Returns the picture coordinate of `value`. A value outside the scale gets the coordinate of the nearer end of
    /// the scale.
    pub(super) fn at(&self, value: f64) -> f64 {
        let share = ((value - self.from.0) / (self.from.1 - self.from.0)).clamp(0.0, 1.0);
        self.to.0 + share * (self.to.1 - self.to.0)
    }

    /// Returns true if `value` is within the range of the scale.
    pub(super) fn holds(&self, value: f64) -> bool {
        (self.from.0..=self.from.1).contains(&value)
    }

    /// Returns round values for the ticks of an axis, at most `most` + 1, and their number of decimals.
    fn ticks(&self, most: f64) -> (Vec<f64>, usize) {
        let step = round_step((self.from.1 - self.from.0) / most);
        let first = (self.from.0 / step).ceil();
        let ticks = (0..50).map(|count| (first + f64::from(count)) * step + 0.0);
        let mut decimals = 0;
        let mut scaled = step;
        while scaled < 0.999 && decimals < 12 {
            scaled *= 10.0;
            decimals += 1;
        }
        (
            ticks.take_while(|tick| *tick <= self.from.1).collect(),
            decimals,
        )
    }
}

impl Frame {
    pub(super) fn at(&self, (x, h): (f64, f64)) -> Point {
        (self.x.at(x), self.h.at(h))
    }
}

/// Returns the smallest value of at least `least` that is 1, 2 or 5 times a power of ten.
pub(super) fn round_step(least: f64) -> f64 {
    let power = 10.0_f64.powf(least.log10().floor());
    let steps = [1.0, 2.0, 5.0].map(|digit| digit * power);
    // The tolerance allows for the rounding of the power of ten.
    steps
        .into_iter()
        .find(|step| *step >= 0.999_999 * least)
        .unwrap_or(10.0 * power)
}

/// Draws the grid, the axes and their ticks. `upright` is the name of the vertical axis.
pub(super) fn draw_axes(canvas: &mut Canvas, frame: &Frame, upright: &str) {
    let (left, right) = frame.x.to;
    let (low, high) = frame.h.to;
    let (bottom, top) = (low.max(high), low.min(high));
    let (ticks, decimals) = frame.h.ticks(8.0);
    for tick in ticks {
        let y = frame.h.at(tick);
        canvas.line((left, y), (right, y), "grid");
        canvas.line((left - 4.0, y), (left, y), "tick");
        canvas.text((left - 7.0, y + 3.5), "end", &format!("{tick:.decimals$}"));
    }
    let (ticks, decimals) = frame.x.ticks(8.0);
    for tick in ticks {
        let x = frame.x.at(tick);
        canvas.line((x, bottom), (x, bottom + 4.0), "tick");
        canvas.text((x, bottom + 15.0), "tick", &format!("{tick:.decimals$}"));
    }
    canvas.line((left, top), (left, bottom), "axis");
    canvas.line((left, bottom), (right, bottom), "axis");
    canvas.text((f64::midpoint(left, right), bottom + 31.0), "axis", "x (m)");
    canvas.upward((14.0, f64::midpoint(top, bottom)), "axis", upright);
}

/// Half of the width that is assumed for lines, so that labels do not touch them.
const HALF_LINE: f64 = 1.6;

#[derive(Clone, Copy)]
pub(super) struct Area {
    low: Point,
    high: Point,
}

/// Areas and lines of a plot that are occupied, so that labels do not overlap them.
pub(super) struct Labels {
    plot: Area,
    taken: Vec<Area>,
    lines: Vec<[Point; 2]>,
}

impl Area {
    pub(super) const fn around((x, y): Point, (width, height): Point) -> Self {
        Self {
            low: (x - width / 2.0, y - height / 2.0),
            high: (x + width / 2.0, y + height / 2.0),
        }
    }

    const fn meets(&self, other: &Self) -> bool {
        self.low.0 < other.high.0
            && other.low.0 < self.high.0
            && self.low.1 < other.high.1
            && other.low.1 < self.high.1
    }

    const fn inside(&self, other: &Self) -> bool {
        self.low.0 >= other.low.0
            && self.high.0 <= other.high.0
            && self.low.1 >= other.low.1
            && self.high.1 <= other.high.1
    }

    /// Returns true if the line between two points crosses the area, by clipping it at each edge.
    fn crossed(&self, [from, to]: &[Point; 2]) -> bool {
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        let sides = [
            (from.0, to.0, self.low.0, self.high.0),
            (from.1, to.1, self.low.1, self.high.1),
        ];
        for (start, end, low, high) in sides {
            let (low, high) = (low - HALF_LINE, high + HALF_LINE);
            let run = end - start;
            if run.abs() < 1e-9 {
                if start <= low || start >= high {
                    return false;
                }
            } else {
                let (a, b) = ((low - start) / run, (high - start) / run);
                enter = enter.max(a.min(b));
                leave = leave.min(a.max(b));
            }
        }
        enter < leave
    }
}

impl Labels {
    /// Creates an empty plot between two corners, in which labels may be placed.
    pub(super) const fn inside(low: Point, high: Point) -> Self {
        Self {
            plot: Area { low, high },
            taken: Vec::new(),
            lines: Vec::new(),
        }
    }

    /// Marks an area as occupied, so that no label is placed in it.
    pub(super) fn take(&mut self, area: Area) {
        self.taken.push(area);
    }

    /// Marks the area of a line as occupied, so that no label is placed over that line.
    pub(super) fn take_line(&mut self, line: [Point; 2]) {
        self.lines.push(line);
    }

    /// Returns true if the line between two points crosses no occupied area.
    pub(super) fn clear(&self, line: &[Point; 2]) -> bool {
        !self.taken.iter().any(|area| area.crossed(line))
    }

    /// Marks the area as occupied if it is inside the plot and free; otherwise returns false.
    pub(super) fn try_take(&mut self, area: Area) -> bool {
        let free = area.inside(&self.plot)
            && !self.taken.iter().any(|other| area.meets(other))
            && !self.lines.iter().any(|line| area.crossed(line));
        if free {
            self.taken.push(area);
        }
        free
    }
}

/// Estimates the width of a text in picture units, for the font size `size`. The estimate tends to be too wide.
///
/// It takes the mean width of a character in a wide sans-serif font.
pub(super) fn width(words: &str, size: f64) -> f64 {
    words.chars().count() as f64 * 0.62 * size
}
