//! Unions of intervals on the line.

/// The interval [low, high]; a point where they are equal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Span {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Span {
    pub(super) fn contains(&self, x: f64) -> bool {
        (self.low..=self.high).contains(&x)
    }
}

/// Returns the union of `spans` as disjoint intervals in rising order.
pub(super) fn merged(mut spans: Vec<Span>) -> Vec<Span> {
    spans.sort_by(|a, b| a.low.total_cmp(&b.low));
    let mut union: Vec<Span> = Vec::with_capacity(spans.len());
    for span in spans {
        match union.last_mut() {
            Some(last) if span.low <= last.high => last.high = last.high.max(span.high),
            _ => union.push(span),
        }
    }
    union
}

/// Returns the intersection of two lists of disjoint intervals in rising order.
pub(super) fn common(a: &[Span], b: &[Span]) -> Vec<Span> {
    let pairs = a.iter().flat_map(|a| b.iter().map(move |b| (a, b)));
    pairs
        .map(|(a, b)| Span {
            low: a.low.max(b.low),
            high: a.high.min(b.high),
        })
        .filter(|span| span.low <= span.high)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{Span, common, merged};

    fn spans(ends: &[(f64, f64)]) -> Vec<Span> {
        ends.iter().map(|&(low, high)| Span { low, high }).collect()
    }

    #[test]
    fn overlaps_and_touches_are_merged() {
        let union = merged(spans(&[(4.0, 5.0), (0.0, 3.0), (1.0, 2.0), (5.0, 6.0)]));
        assert_eq!(union, spans(&[(0.0, 3.0), (4.0, 6.0)]));
        assert_eq!(merged(Vec::new()), Vec::new());
    }

    #[test]
    fn points_may_be_common() {
        let (a, b) = (
            spans(&[(0.0, 2.0), (3.0, 9.0)]),
            spans(&[(2.0, 4.0), (8.0, 8.0)]),
        );
        assert_eq!(common(&a, &b), spans(&[(2.0, 2.0), (3.0, 4.0), (8.0, 8.0)]));
    }
}
