//! Accuracy and cost of micromath and libm in f32: the reason to use micromath for bearings alone.
//!
//! `cargo test --test accuracy -- --nocapture` prints the table, with `--release` and `--include-ignored` also the times.

use std::hint::black_box;
use std::time::Instant;

use micromath::F32;

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Error {
    /// Relative error: the difference from the exact value as a fraction of that value.
    Relative,
    /// Absolute error: the difference from the exact value, in the function's `unit`.
    Absolute,
}

/// Mathematical function under test, as computed by micromath, by libm and exactly in f64.
struct Function {
    name: &'static str,
    /// Unit of the absolute error, as a text.
    unit: &'static str,
    error: Error,
    /// Range of the test points x. The points of a range above 0 are spaced logarithmically, the points of other
    /// ranges evenly.
    range: [f64; 2],
    /// Maps a test point x to the arguments of the tested function. A function of one argument ignores the second one.
    arguments: fn(f64) -> [f64; 2],
    micromath: fn([f32; 2]) -> f32,
    libm: fn([f32; 2]) -> f32,
    exact: fn([f64; 2]) -> f64,
    /// Largest permitted errors, first of micromath and then of libm: the measured errors, rounded up.
    largest: [f64; 2],
}

const FUNCTIONS: [Function; 6] = [
    Function {
        name: "atan2",
        unit: "degrees",
        error: Error::Absolute,
        range: [-179.99, 179.99],
        arguments: |x| [x.to_radians().sin(), x.to_radians().cos()],
        micromath: |[y, x]| F32(y).atan2(F32(x)).0.to_degrees(),
        libm: |[y, x]| libm::atan2f(y, x).to_degrees(),
        exact: |[y, x]| y.atan2(x).to_degrees(),
        largest: [0.1621, 2e-5],
    },
    Function {
        name: "sqrt",
        unit: "",
        error: Error::Relative,
        range: [1e-12, 1e12],
        arguments: |x| [x, 1.0],
        micromath: |[x, _]| F32(x).sqrt().0,
        libm: |[x, _]| libm::sqrtf(x),
        exact: |[x, _]| x.sqrt(),
        largest: [0.0607, 6e-8],
    },
    Function {
        name: "hypot",
        unit: "",
        error: Error::Relative,
        range: [1e-6, 1e6],
        arguments: |x| [x, 1.0],
        micromath: |[x, y]| F32(x).hypot(F32(y)).0,
        libm: |[x, y]| libm::hypotf(x, y),
        exact: |[x, y]| x.hypot(y),
        largest: [0.0607, 9e-8],
    },
    Function {
        name: "10 log10",
        unit: "dB",
        error: Error::Absolute,
        range: [1e-12, 1e12],
        arguments: |x| [x, 1.0],
        micromath: |[x, _]| 10.0 * F32(x).log10().0,
        libm: |[x, _]| 10.0 * libm::log10f(x),
        exact: |[x, _]| 10.0 * x.log10(),
        largest: [0.512, 9e-6],
    },
    Function {
        name: "ln",
        unit: "",
        error: Error::Absolute,
        range: [1e-12, 1e12],
        arguments: |x| [x, 1.0],
        micromath: |[x, _]| F32(x).ln().0,
        libm: |[x, _]| libm::logf(x),
        exact: |[x, _]| x.ln(),
        largest: [0.119, 1e-6],
    },
    Function {
        name: "exp",
        unit: "",
        error: Error::Relative,
        range: [-20.0, 20.0],
        arguments: |x| [x, 1.0],
        micromath: |[x, _]| F32(x).exp().0,
        libm: |[x, _]| libm::expf(x),
        exact: |[x, _]| x.exp(),
        largest: [2.4e-3, 8e-8],
    },
];

const POINTS: u32 = 400_000;

fn arguments(function: &Function) -> impl Iterator<Item = [f32; 2]> {
    let [low, high] = function.range;
    (0..=POINTS).map(move |i| {
        let share = f64::from(i) / f64::from(POINTS);
        let x = if low > 0.0 {
            low * (high / low).powf(share)
        } else {
            low + (high - low) * share
        };
        (function.arguments)(x).map(|argument| argument as f32)
    })
}

fn largest(function: &Function, approximate: fn([f32; 2]) -> f32) -> f64 {
    arguments(function)
        .map(|x| {
            let exact = (function.exact)(x.map(f64::from));
            let off = (f64::from(approximate(x)) - exact).abs();
            match function.error {
                Error::Relative => off / exact.abs(),
                Error::Absolute => off,
            }
        })
        .fold(0.0, f64::max)
}

#[test]
fn the_stated_errors_of_both_libraries_are_right() {
    println!("| function | error | micromath | libm |\n| --- | --- | --- | --- |");
    for function in &FUNCTIONS {
        let found = [function.micromath, function.libm].map(|f| largest(function, f));
        let [micromath, libm] = found;
        println!(
            "| {} | {:?} {} | {micromath:.2e} | {libm:.2e} |",
            function.name, function.error, function.unit
        );
        for (found, stated) in found.into_iter().zip(function.largest) {
            assert!(found <= stated, "{}: {found}", function.name);
            // The stated error must not be far above the measured one.
            assert!(found >= 0.5 * stated, "{}: {found}", function.name);
        }
    }
}

#[test]
#[ignore = "measures time"]
fn cost_of_both_libraries_on_the_host() {
    println!("| function | micromath, ns | libm, ns | ratio |\n| --- | --- | --- | --- |");
    for function in &FUNCTIONS {
        let x: Vec<[f32; 2]> = arguments(function).collect();
        let [micromath, libm] = [function.micromath, function.libm].map(|f| {
            let start = Instant::now();
            for &x in &x {
                black_box(f(black_box(x)));
            }
            start.elapsed().as_secs_f64() * 1e9 / f64::from(POINTS)
        });
        println!(
            "| {} | {micromath:.1} | {libm:.1} | {:.2} |",
            function.name,
            libm / micromath
        );
    }
}
