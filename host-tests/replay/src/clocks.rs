//! Merges the frames of several files by their clocks.
//!
//! The clock of the first file is the reference. A frame that occurs in two files connects their clocks. It was sent
//! in one and received in the other, or received in both.
//!
//! A received frame is later than the sent one by its delay. So frames in one direction give lower bounds of the
//! clock offset, and frames in the other direction upper bounds. In each `WINDOW` the mean of the closest two bounds
//! is taken, in which the shortest delays of both directions cancel.
//!
//! Between windows the offset is interpolated, which follows the drift. A step of a clock ends an interpolation.
//! Steps of the first file's clock are left out.

use std::collections::HashMap;

use uav_relay_capture::Direction;

use crate::recording::{Frame, Recording, retain};

/// Length of a time window in which a file's clock is assumed to have a constant offset, s.
///
/// Clocks are assumed to drift by at most 100 ppm: 2 ms in a window.
const WINDOW: f64 = 20.0;

/// Minimum step (sudden change) of a file's clock, s.
///
/// A step is a change of the clock's offset between two successive frames that other files have, too, or a decrease of
/// the time from one frame to the next.
const STEP: f64 = 2.0;

/// Maximum time between two files of one flight, s, if no frame is in both files.
///
/// The same limit applies to the time between two consecutive frames of one file.
const APART: f64 = 3_600.0;

/// Offset of a file's clock from the first file's clock, and the number of frames that determine it.
#[derive(Clone, PartialEq, Debug)]
pub struct Alignment {
    /// Name of the capture file.
    pub name: String,
    /// Number of frames in common with the other files; `None` for the first file.
    pub common: Option<usize>,
    /// Smallest and largest offset added to the times of the file, s.
    pub offset_s: [f64; 2],
}

/// Part of a file between two steps of its clock. It begins at the frame with the index `from`.
///
/// `offsets` has pairs, s: a time of the file's clock, and the offset of the clock at that time.
struct Segment {
    from: usize,
    offsets: Vec<(f64, f64)>,
}

impl Segment {
    fn offset(&self, at: f64) -> f64 {
        let after = self.offsets.partition_point(|(time, _)| *time < at);
        let beside = [after.checked_sub(1), Some(after)].map(|index| self.offsets.get(index?));
        match beside {
            [Some((t0, one)), Some((t1, other))] => one + (other - one) * (at - t0) / (t1 - t0),
            [Some((_, only)), None] | [None, Some((_, only))] => *only,
            [None, None] => 0.0,
        }
    }
}

/// Bounds of the clock offset in a time window, s.
///
/// The bounds `least` and `most` come from frames that one file has as sent and the other file as received. `equal` has
/// the offsets computed from all other common frames.
#[derive(Default)]
struct Window {
    times: Vec<f64>,
    least: Option<f64>,
    most: Option<f64>,
    equal: Vec<f64>,
}

impl Window {
    fn add(&mut self, own: &Frame, other: (f64, Direction)) {
        let offset = other.0 - own.at;
        self.times.push(own.at);
        match (own.direction, other.1) {
            (Direction::In, Direction::Out) => {
                self.least = Some(self.least.map_or(offset, |it| it.max(offset)));
            }
            (Direction::Out, Direction::In) => {
                self.most = Some(self.most.map_or(offset, |it| it.min(offset)));
            }
            _ => self.equal.push(offset),
        }
    }

    fn offset(mut self) -> Option<(f64, f64)> {
        let at = self.times.iter().sum::<f64>() / self.times.len() as f64;
        self.equal.sort_by(f64::total_cmp);
        let middle = self.equal.get(self.equal.len() / 2).copied();
        let offset = match (self.least, self.most) {
            (Some(least), Some(most)) => Some(f64::midpoint(least, most)),
            (one, other) => middle.or(one).or(other),
        };
        Some((at, offset?))
    }
}

/// Returns a map from each frame's bytes to its index; `None` if several frames have the same bytes.
fn once(frames: &[Frame]) -> HashMap<&[u8], Option<usize>> {
    let mut known = HashMap::new();
    for (index, frame) in frames.iter().enumerate() {
        let entry = known.entry(frame.wire.as_slice());
        entry.and_modify(|it| *it = None).or_insert(Some(index));
    }
    known
}

/// Map from the bytes of a frame in the aligned files to its time and direction.
///
/// The time is by the reference clock. If one file has the frame as sent and others as received, the map has the sent
/// one.
type Aligned = HashMap<Vec<u8>, (f64, Direction)>;

fn add(aligned: &mut Aligned, frames: &[Frame]) {
    for index in once(frames).into_values().flatten() {
        if let Some(frame) = frames.get(index)
            && (frame.direction == Direction::Out || !aligned.contains_key(&frame.wire))
        {
            aligned.insert(frame.wire.clone(), (frame.at, frame.direction));
        }
    }
}

/// Frames of all files, merged by time.
#[derive(Clone, Debug)]
pub struct Merged {
    /// Frames in order of time. A frame that several files have occurs once.
    pub frames: Vec<Frame>,
    /// Relation of each file's clock to that of the first file.
    pub files: Vec<Alignment>,
    /// Warnings about the capture files, one line each.
    pub warnings: Vec<String>,
}

/// Merges the frames of all files.
///
/// # Errors
/// One line that names a file of a different chain or flight.
pub fn merge(mut files: Vec<Recording>) -> Result<Merged, String> {
    let mut warnings = Vec::new();
    if let Some(first) = files.first() {
        for other in &files {
            one_chain(first, other)?;
        }
    }
    // Otherwise the operator's commands in the file would count twice.
    for (index, file) in files.iter().enumerate() {
        if let Some(before) = files.iter().take(index).find(|it| is_copy(it, file)) {
            return Err(format!(
                "{}: is the same capture as {}, or a part of it: give the longer one only",
                file.name, before.name
            ));
        }
    }
    if let Some(first) = files.first_mut()
        && let Some(steps) = without_steps(&mut first.frames)
    {
        warnings.push(format!(
            "{}: its clock, the reference for all files, jumps {steps}: corrected; name a file with a steady clock first",
            first.name
        ));
    }
    for file in &files {
        if let Some(fault) = &file.fault {
            warnings.push(format!(
                "{}: damaged after {} frames, the rest is left out: {fault}",
                file.name,
                file.frames.len()
            ));
        }
    }
    let mut alignments: Vec<Option<Alignment>> = vec![None; files.len()];
    let mut aligned = Aligned::new();
    let mut span = [f64::INFINITY, f64::NEG_INFINITY];
    while alignments.contains(&None) {
        let waiting = alignments.iter().enumerate().filter(|(_, it)| it.is_none());
        // After the first file, the next one is always the file with the most frames in common with the aligned files.
        let counted = waiting.map(|(index, _)| {
            let frames = files.get(index).map_or(&[][..], |it| &it.frames);
            let own = once(frames);
            let common = own
                .iter()
                .filter(|(wire, it)| it.is_some() && aligned.contains_key(**wire));
            (common.count(), index)
        });
        let best = counted.max_by_key(|(common, index)| (*common, usize::MAX - index));
        let Some((common, index)) = best else { break };
        let (Some(file), Some(alignment)) = (files.get_mut(index), alignments.get_mut(index))
        else {
            break;
        };
        let is_first = aligned.is_empty();
        if common == 0 && !is_first {
            own_clock(file, span)?;
            warnings.push(format!(
                "{}: no frame in common with the other files: placed by its own clock",
                file.name
            ));
        }
        *alignment = Some(align(file, &aligned, (!is_first).then_some(common)));
        for frame in &file.frames {
            span = [span[0].min(frame.at), span[1].max(frame.at)];
        }
        add(&mut aligned, &file.frames);
    }
    let mut frames: Vec<Frame> = files.into_iter().flat_map(|file| file.frames).collect();
    frames.sort_by(|one, other| one.at.total_cmp(&other.at));
    // A frame that several nodes captured, or that an attacker replayed, counts once.
    let mut known = std::collections::HashSet::new();
    retain(&mut frames, "", |it| known.insert(it.wire.clone()));
    // A clock may still have a step after the file's last common frame.
    if let Some(steps) = without_steps(&mut frames) {
        warnings.push(format!("the time of the flight jumps {steps}: corrected"));
    }
    Ok(Merged {
        frames,
        files: alignments.into_iter().flatten().collect(),
        warnings,
    })
}

/// Removes steps (sudden changes) of a file's clock: more than [`STEP`] backward or [`APART`] forward.
///
/// All times before a step are shifted by the step, so that the times after the last step stay the same. Returns a
/// description of the steps, if any.
fn without_steps(frames: &mut [Frame]) -> Option<String> {
    let times: Vec<f64> = frames.iter().map(|frame| frame.at).collect();
    let pairs = times.iter().zip(times.iter().skip(1));
    let changes = pairs.map(|(one, other)| other - one);
    let steps = (1..).zip(changes);
    let steps: Vec<(usize, f64)> = steps
        .filter(|(_, step)| *step < -STEP || *step > APART)
        .collect();
    let (first, size) = *steps.first()?;
    let mut by: f64 = steps.iter().map(|(_, step)| step).sum();
    let mut rest = steps.iter().peekable();
    for (index, frame) in frames.iter_mut().enumerate() {
        if let Some((_, step)) = rest.next_if(|(at, _)| *at == index) {
            by -= step;
        }
        frame.at += by;
    }
    let all = match steps.len() {
        1 => String::new(),
        all => format!(" ({all} jumps in all)"),
    };
    let after = times.get(first - 1)? - times.first()?;
    Some(format!(
        "by {size:+.1} s, {after:.0} s after its first frame{all}"
    ))
}

fn one_chain(first: &Recording, other: &Recording) -> Result<(), String> {
    let differ = |what: &str, own: String, others: String| {
        Err(format!(
            "{}: {what} {own}, but {} has {others}: the files are of different chains",
            other.name, first.name
        ))
    };
    if other.network != first.network {
        return differ(
            "network",
            other.network.to_string(),
            first.network.to_string(),
        );
    }
    match (first.mission, other.mission) {
        (Some(one), Some(own)) if one != own => {
            differ("mission digest", format!("{own:04x}"), format!("{one:04x}"))
        }
        _ => Ok(()),
    }
}

/// Returns true if the shorter recording is the beginning of the longer one.
fn is_copy(one: &Recording, other: &Recording) -> bool {
    one.frames
        .iter()
        .zip(&other.frames)
        .all(|(a, b)| (a.at, a.direction, &a.wire) == (b.at, b.direction, &b.wire))
}

/// Checks that a file without common frames is from the same flight: its times are close to `span`.
///
/// `span` has the first and the last time of the other files, s. The times of the file are those of its own clock.
fn own_clock(file: &Recording, span: [f64; 2]) -> Result<(), String> {
    let times = file.frames.iter().map(|frame| frame.at);
    let [first, last] = times.fold([f64::INFINITY, f64::NEG_INFINITY], |[least, most], at| {
        [least.min(at), most.max(at)]
    });
    let apart = (first - span[1]).max(span[0] - last);
    if apart <= APART {
        return Ok(());
    }
    Err(format!(
        "{}: no frame in common with the other files, and {:.1} h apart from them by its clock: not of the same flight",
        file.name,
        apart / 3_600.0
    ))
}

/// Returns the index of the frame with the largest change of time from the previous frame.
///
/// Only frames with indices above `from` and up to `to` count.
fn step_between(frames: &[Frame], from: usize, to: usize) -> usize {
    let change = |index: &usize| {
        let [one, other] =
            [index.saturating_sub(1), *index].map(|it| frames.get(it).map_or(0.0, |it| it.at));
        (other - one).abs()
    };
    let all = from + 1..=to;
    all.max_by(|one, other| change(one).total_cmp(&change(other)))
        .unwrap_or(to)
}

/// Converts the times of a file to the reference clock. Returns the offsets that were added.
///
/// `aligned` has the frames of the files that have been converted before; `common` is the number of frames in common.
fn align(file: &mut Recording, aligned: &Aligned, common: Option<usize>) -> Alignment {
    let own = once(&file.frames);
    let mut windows: Vec<(usize, Vec<Window>)> = Vec::new();
    let (mut last, mut begun, mut before) = (f64::INFINITY, 0.0, 0);
    for (index, frame) in file.frames.iter().enumerate() {
        let is_once = own.get(frame.wire.as_slice()) == Some(&Some(index));
        let Some(other) = aligned.get(&frame.wire).filter(|_| is_once) else {
            continue;
        };
        let offset = other.0 - frame.at;
        if (offset - last).abs() > STEP {
            let from = if windows.is_empty() {
                0
            } else {
                step_between(&file.frames, before, index)
            };
            windows.push((from, vec![Window::default()]));
            begun = frame.at;
        }
        (last, before) = (offset, index);
        if let Some((_, windows)) = windows.last_mut() {
            if frame.at >= begun + WINDOW {
                windows.push(Window::default());
                begun = frame.at;
            }
            if let Some(window) = windows.last_mut() {
                window.add(frame, *other);
            }
        }
    }
    drop(own);
    let segments = windows.into_iter().map(|(from, windows)| Segment {
        from,
        offsets: windows.into_iter().filter_map(Window::offset).collect(),
    });
    let segments: Vec<Segment> = segments.collect();
    let mut offset_s = [f64::INFINITY, f64::NEG_INFINITY];
    for (index, frame) in file.frames.iter_mut().enumerate() {
        let segment = segments.iter().rev().find(|it| it.from <= index);
        let offset = segment.map_or(0.0, |it| it.offset(frame.at));
        offset_s = [offset_s[0].min(offset), offset_s[1].max(offset)];
        frame.at += offset;
    }
    Alignment {
        name: file.name.clone(),
        common,
        offset_s,
    }
}
