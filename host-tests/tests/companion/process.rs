//! Relay or ground station as a process: its lines, exit and processor load. It is killed when dropped.

use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use crate::binary::{companion, ground};

/// Timeout of any quick action on a busy machine.
pub(crate) const LIMIT: Duration = Duration::from_secs(120);

#[derive(Debug)]
pub(crate) struct Relay {
    child: Child,
    lines: Receiver<String>,
    errors: Receiver<String>,
    seen: Vec<String>,
    name: String,
}

/// Exit status and output of a process.
#[derive(Debug)]
pub(crate) struct Ended {
    /// Exit status; `None` after a signal.
    pub(crate) status: Option<i32>,
    pub(crate) stdout: Vec<String>,
    pub(crate) stderr: Vec<String>,
}

pub(crate) fn lines_of(pipe: impl Read + Send + 'static) -> Receiver<String> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        for line in BufReader::new(pipe).lines().map_while(Result::ok) {
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    receiver
}

impl Relay {
    pub(crate) fn start(arguments: &[&str]) -> Self {
        Self::run(companion(), arguments)
    }

    pub(crate) fn ground(arguments: &[&str]) -> Self {
        Self::run(ground(), arguments)
    }

    fn run(program: &Path, arguments: &[&str]) -> Self {
        let mut child = Command::new(program)
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        Self {
            lines: lines_of(child.stdout.take().unwrap()),
            errors: lines_of(child.stderr.take().unwrap()),
            child,
            seen: Vec::new(),
            name: arguments.join(" "),
        }
    }

    /// Waits for the next line that contains `part`.
    pub(crate) fn line(&mut self, part: &str) -> String {
        let end = Instant::now() + LIMIT;
        loop {
            let left = end.saturating_duration_since(Instant::now());
            let Ok(line) = self.lines.recv_timeout(left) else {
                let mut story = format!("{}: no `{part}`", self.name);
                for line in self.seen.drain(..).chain(self.errors.try_iter()) {
                    write!(story, "\n{line}").unwrap();
                }
                panic!("{story}");
            };
            self.seen.push(line.clone());
            if line.contains(part) {
                return line;
            }
        }
    }

    /// Returns true if a line so far contains `part`.
    pub(crate) fn has_said(&mut self, part: &str) -> bool {
        self.seen.extend(self.lines.try_iter());
        self.seen.iter().any(|line| line.contains(part))
    }

    /// Returns the lines that contain `part` since the last call.
    pub(crate) fn lines_with(&mut self, part: &str) -> Vec<String> {
        let lines: Vec<String> = self.lines.try_iter().collect();
        self.seen.extend(lines.iter().cloned());
        lines
            .into_iter()
            .filter(|line| line.contains(part))
            .collect()
    }

    /// Returns the bits of x, y, altitude and target, once the relay has agreed on them.
    pub(crate) fn settled(&mut self) -> [u32; 4] {
        let setpoint = bits(&self.line("setpoint: "));
        let target = bits(&self.line("converged: "));
        [setpoint[0], setpoint[1], setpoint[2], target[0]]
    }

    /// Waits until the relay has agreed on these bits of x, y, altitude and target, possibly after others.
    pub(crate) fn settles_at(&mut self, expected: [u32; 4]) {
        let mut place = Vec::new();
        loop {
            let line = self.line(" (0x");
            let mut agreed = bits(&line);
            if !line.contains("converged: ") {
                place = agreed;
                continue;
            }
            agreed.splice(0..0, place.iter().copied());
            if agreed == expected {
                return;
            }
        }
    }

    pub(crate) fn signal(&self, signal: Signal) {
        kill_process(self.pid(), signal).unwrap();
    }

    pub(crate) fn pid(&self) -> Pid {
        Pid::from_child(&self.child)
    }

    /// Waits for the exit.
    pub(crate) fn end(mut self) -> Ended {
        let end = Instant::now() + LIMIT;
        let status = loop {
            match self.child.try_wait().unwrap() {
                Some(status) => break status,
                None if Instant::now() > end => panic!("{}: does not end", self.name),
                None => std::thread::sleep(Duration::from_millis(2)),
            }
        };
        let mut stdout = std::mem::take(&mut self.seen);
        stdout.extend(self.lines.iter());
        Ended {
            status: status.code(),
            stdout,
            stderr: self.errors.iter().collect(),
        }
    }

    /// Returns the processor time and the number of voluntary sleeps so far.
    pub(crate) fn cost(&self) -> (Duration, u64) {
        let file = |name| std::fs::read_to_string(format!("/proc/{}/{name}", self.child.id()));
        let stat = file("stat").unwrap();
        // Fields 14 and 15. Field 2, the name, is in parentheses and may contain any characters.
        let fields: Vec<&str> = stat[stat.rfind(')').unwrap() + 2..].split(' ').collect();
        let ticks: u64 = fields[11].parse::<u64>().unwrap() + fields[12].parse::<u64>().unwrap();
        let millis = ticks * 1_000 / rustix::param::clock_ticks_per_second();
        let status = file("status").unwrap();
        let sleeps = status
            .lines()
            .find_map(|line| line.strip_prefix("voluntary_ctxt_switches:"));
        let sleeps = sleeps.unwrap().trim().parse().unwrap();
        (Duration::from_millis(millis), sleeps)
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        // The process may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Returns the numbers that a line prints as bits.
pub(crate) fn bits(line: &str) -> Vec<u32> {
    let mut parts = line.split("(0x");
    parts.next();
    parts
        .map(|part| u32::from_str_radix(&part[..8], 16).unwrap())
        .collect()
}
