//! Finding room: a label is placed where it covers nothing, or not at all.

use super::canvas::Point;

/// Lines have a width too.
const HALF_LINE: f64 = 1.6;

/// An upright rectangle.
#[derive(Clone, Copy)]
pub(super) struct Area {
    low: Point,
    high: Point,
}

/// What is already drawn in the plot.
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

    /// Whether a line passes through: what is left of it after cutting at each edge in turn.
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
    /// An empty plot with these corners.
    pub(super) const fn inside(low: Point, high: Point) -> Self {
        Self {
            plot: Area { low, high },
            taken: Vec::new(),
            lines: Vec::new(),
        }
    }

    /// Notes that something stands here, whatever stood there before.
    pub(super) fn take(&mut self, area: Area) {
        self.taken.push(area);
    }

    /// Notes that a line runs here.
    pub(super) fn take_line(&mut self, line: [Point; 2]) {
        self.lines.push(line);
    }

    /// Whether a line would run through nothing but other lines.
    pub(super) fn clear(&self, line: &[Point; 2]) -> bool {
        !self.taken.iter().any(|area| area.crossed(line))
    }

    /// Takes the area and tells so, if it lies in the plot and covers nothing.
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

/// Width of a text, by an average letter of a wide sans-serif face; better too wide than too narrow.
pub(super) fn width(words: &str, size: f64) -> f64 {
    words.chars().count() as f64 * 0.62 * size
}
