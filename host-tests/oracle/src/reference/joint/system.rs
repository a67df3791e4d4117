//! Linear system of a chain. One 3 x 3 block per relay, coupled to its neighbours, and one more unknown coupled to all.

use super::space::{Factor, Square, Triple};

/// Rows of one relay in a symmetric system.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Block {
    /// Coefficients of the relay itself; symmetric.
    pub(super) own: Square,
    pub(super) before: Square,
    pub(super) common: Triple,
    pub(super) right: Triple,
}

impl Block {
    /// Fixes the coordinates for which `free`, or `free_before` of the predecessor, is 0.
    pub(super) fn held(self, free: Triple, free_before: Triple) -> Self {
        let fixed = Triple::new(1.0, 1.0, 1.0) - free;
        Self {
            own: self.own.scaled(free, free) + Square::diagonal(fixed),
            before: self.before.scaled(free, free_before),
            common: self.common.times(free),
            right: self.right.times(free),
        }
    }
}

/// Solves the system in O(N), with `corner` on the common unknown's diagonal. `None` unless it is positive definite.
pub(super) fn solve(
    blocks: &[Block],
    corner: f64,
    corner_right: f64,
) -> Option<(Vec<Triple>, f64)> {
    // Per relay: factor of its reduced block, and reduced right-hand sides (of the system, of the common column).
    let mut reduced: Vec<(Factor, Triple, Triple)> = Vec::with_capacity(blocks.len());
    for block in blocks {
        let (mut own, mut right, mut common) = (block.own, block.right, block.common);
        if let Some(&(factor, last_right, last_common)) = reduced.last() {
            let carry = block.before.by_rows(|row| factor.solve(row));
            // Rows of `before` times columns of the transpose of `carry`, symmetric except for rounding.
            own = own - carry.by_rows(|row| block.before.apply(row));
            right = right - carry.apply(last_right);
            common = common - carry.apply(last_common);
        }
        reduced.push((own.factor()?, right, common));
    }
    let mut columns = Vec::with_capacity(blocks.len());
    let (mut right, mut common) = (Triple::default(), Triple::default());
    let mut link = Square::default();
    for (block, &(factor, own_right, own_common)) in blocks.iter().zip(&reduced).rev() {
        right = factor.solve(own_right - link.apply(right));
        common = factor.solve(own_common - link.apply(common));
        link = block.before.transpose();
        columns.push((right, common));
    }
    columns.reverse();
    let (mut pivot, mut rest) = (corner, corner_right);
    for (block, &(right, common)) in blocks.iter().zip(&columns) {
        pivot -= block.common.dot(common);
        rest -= block.common.dot(right);
    }
    let last = rest / pivot;
    (pivot > 0.0 && last.is_finite()).then(|| {
        let steps = columns
            .into_iter()
            .map(|(right, common)| right - common * last);
        (steps.collect(), last)
    })
}
