//! Label placement: a label is drawn only where it covers nothing.

use super::canvas::Point;

/// Half of the assumed line width.
const HALF_LINE: f64 = 1.6;

#[derive(Clone, Copy)]
pub(super) struct Area {
    low: Point,
    high: Point,
}

/// Occupied areas and lines of the plot.
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

    /// Returns true if a line crosses the area (clipping at each edge).
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
    /// Empty plot with these corners.
    pub(super) const fn inside(low: Point, high: Point) -> Self {
        Self {
            plot: Area { low, high },
            taken: Vec::new(),
            lines: Vec::new(),
        }
    }

    /// Marks an area as occupied.
    pub(super) fn take(&mut self, area: Area) {
        self.taken.push(area);
    }

    /// Marks a line as occupied.
    pub(super) fn take_line(&mut self, line: [Point; 2]) {
        self.lines.push(line);
    }

    /// Returns true if a line crosses no occupied area.
    pub(super) fn clear(&self, line: &[Point; 2]) -> bool {
        !self.taken.iter().any(|area| area.crossed(line))
    }

    /// Occupies the area if it is inside the plot and free. Returns true on success.
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

/// Estimates the width of a text from a wide sans-serif font's average. Rather too wide than too narrow.
pub(super) fn width(words: &str, size: f64) -> f64 {
    words.chars().count() as f64 * 0.62 * size
}
