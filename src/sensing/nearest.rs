//! The source that comes nearest to sums which no source would make: on a grid, and a finer one about the best of it.
//!
//! Of a source at (X', Y') the coefficients are k g, g = (X'^2 + Y'^2 + 1/3, -2 X', 1, -2 Y'). The best k is m g / (g G g), G the
//! products and m those with v; and what it leaves of the sums is least where (m g)^2 / (g G g) is largest. Two numbers are left to look for.

/// As far as sources are looked for, in halves of the distance: from one distance before Tx to one beyond Rx, and 1.5 to the side.
const FARTHEST: f32 = 3.0;

/// Steps from the middle to the edge of the first grid, and of the finer ones.
const COARSE: i8 = 8;
const FINE: i8 = 2;

/// Finer grids, each a third as wide as the one before.
const FINER: u8 = 5;

/// X', Y' and k of the source nearest to these products, and on this side of the line of places (1 or -1, from `side` on). 414 places,
/// some 16 000 instructions on a Cortex-M4F. `None` where no source makes anything of them.
pub(super) fn nearest(
    products: &[f32; 10],
    right: &[f32; 4],
    side: f32,
    sign: f32,
) -> Option<[f32; 3]> {
    let mut best = Best {
        products,
        right,
        score: 0.0,
        at: None,
    };
    let step = FARTHEST / f32::from(COARSE);
    best.look([0.0, side], step, COARSE, side, sign);
    let mut step = step;
    for _ in 0..FINER {
        let [x, y, _] = best.at?;
        step *= 0.4;
        best.look([x, y], step, FINE, side, sign);
    }
    best.at
}

struct Best<'a> {
    products: &'a [f32; 10],
    right: &'a [f32; 4],
    score: f32,
    at: Option<[f32; 3]>,
}

impl Best<'_> {
    fn look(&mut self, [x, y]: [f32; 2], step: f32, steps: i8, side: f32, sign: f32) {
        for i in -steps..=steps {
            for j in -steps..=steps {
                let (x, y) = (x + f32::from(i) * step, y + f32::from(j) * step);
                if (y - side) * sign >= 0.0 {
                    self.weigh(x, y);
                }
            }
        }
    }

    fn weigh(&mut self, x: f32, y: f32) {
        let [aa, ab, ac, ad, bb, bc, bd, cc, cd, dd] = *self.products;
        let [av, bv, cv, dv] = *self.right;
        let (a, b, d) = (x * x + y * y + 1.0 / 3.0, -2.0 * x, -2.0 * y);
        let with = a * av + b * bv + cv + d * dv;
        let square = a * (aa * a + 2.0 * (ab * b + ac + ad * d))
            + b * (bb * b + 2.0 * (bc + bd * d))
            + cc
            + d * (2.0 * cd + dd * d);
        let score = with * with / square;
        if with > 0.0 && square > 0.0 && score > self.score {
            self.score = score;
            self.at = Some([x, y, with / square]);
        }
    }
}
