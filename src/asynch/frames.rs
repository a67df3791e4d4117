//! Queue of whole frames for a port.

use heapless::Deque;

use crate::wire::frame::{FrameBuf, MAX_FRAME};

/// Capacity: two frames of full length, beside the one that the port is sending.
const ROOM: usize = 2 * MAX_FRAME;

/// Queued frames in sending order, each with its delimiter.
#[derive(Debug)]
pub(super) struct Frames(Deque<u8, ROOM>);

impl Frames {
    pub(super) const fn new() -> Self {
        Self(Deque::new())
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns true if one more frame of any length fits.
    pub(super) fn has_room(&self) -> bool {
        ROOM.saturating_sub(self.0.len()) >= MAX_FRAME
    }

    /// Queues a whole frame; returns false if it does not fit.
    pub(super) fn push(&mut self, frame: &[u8]) -> bool {
        let fits = frame.len() <= ROOM.saturating_sub(self.0.len());
        if fits {
            for &byte in frame {
                // The capacity was checked above.
                let _ = self.0.push_back(byte);
            }
        }
        fits
    }

    /// Moves the first frame into `frame` and returns its length; 0 if there is none.
    pub(super) fn pop(&mut self, frame: &mut FrameBuf) -> usize {
        let mut len = 0;
        for place in frame {
            let Some(byte) = self.0.pop_front() else {
                break;
            };
            *place = byte;
            len += 1;
            if byte == 0 {
                break;
            }
        }
        len
    }
}

#[cfg(test)]
mod tests {
    use super::{Frames, MAX_FRAME};

    #[test]
    fn frames_come_out_whole_and_in_order_and_what_does_not_fit_stays_out() {
        let mut frames = Frames::new();
        let mut longest = [7; MAX_FRAME];
        longest[MAX_FRAME - 1] = 0;
        assert!(frames.push(&[1, 2, 0]) && frames.push(&longest));
        assert!(!frames.has_room());
        assert!(!frames.push(&longest), "three bytes short");
        assert!(frames.push(&[3, 0]));
        let mut frame = [0; MAX_FRAME];
        assert_eq!(frames.pop(&mut frame), 3);
        assert_eq!(frame[..3], [1, 2, 0]);
        assert_eq!(frames.pop(&mut frame), MAX_FRAME);
        assert_eq!(frame, longest);
        assert_eq!((frames.pop(&mut frame), frame[0]), (2, 3));
        assert_eq!(frames.pop(&mut frame), 0);
        assert!(frames.is_empty() && frames.has_room());
    }
}
