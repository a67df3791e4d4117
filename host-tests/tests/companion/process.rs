//! Relay or ground station as a process: its options, lines, exit and processor load. It is killed when dropped.

use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};

use crate::binary::{companion, ground};

/// Timeout of any action of a process under test, for a busy machine.
pub(crate) const LIMIT: Duration = Duration::from_secs(120);

#[derive(Debug)]
pub(crate) struct Relay {
    child: Child,
    lines: Receiver<String>,
    errors: Receiver<String>,
    seen: Vec<String>,
    name: String,
}

/// Exit status and output lines of a process that has ended.
#[derive(Debug)]
pub(crate) struct Ended {
    /// Exit status; `None` if a signal ended the process.
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
    /// Starts a companion process. Its options are separated by white space.
    pub(crate) fn start(options: &str) -> Self {
        Self::run(companion(), &words(options), Stdio::piped())
    }

    /// Starts a ground station process. Its options are separated by white space.
    pub(crate) fn ground(options: &str) -> Self {
        Self::run(ground(), &words(options), Stdio::piped())
    }

    /// Starts `program`. Tests can wait for lines of its output if the output is piped.
    pub(crate) fn run(program: &Path, options: &[&str], output: Stdio) -> Self {
        let mut command = Command::new(program);
        command.args(options).stdout(output);
        Self::of(&mut command)
    }

    /// Starts a command as a process whose error output is read.
    pub(crate) fn of(command: &mut Command) -> Self {
        let piped = command.stdin(Stdio::null()).stderr(Stdio::piped());
        let mut child = piped.spawn().unwrap();
        Self {
            lines: child.stdout.take().map_or_else(|| channel().1, lines_of),
            errors: lines_of(child.stderr.take().unwrap()),
            child,
            seen: Vec::new(),
            name: format!("{command:?}"),
        }
    }

    /// Waits for the next output line that contains `part`, and returns the line.
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

    /// Returns the new lines of the error output.
    pub(crate) fn errors(&mut self) -> Vec<String> {
        self.errors.try_iter().collect()
    }

    /// Returns true if a line that the process has printed contains `part`.
    pub(crate) fn has_printed(&mut self, part: &str) -> bool {
        self.seen.extend(self.lines.try_iter());
        self.seen.iter().any(|line| line.contains(part))
    }

    /// Waits for a line that contains `part`; returns at once if the process has printed such a line.
    pub(crate) fn wait_for(&mut self, part: &str) {
        if !self.has_printed(part) {
            self.line(part);
        }
    }

    /// Returns those of the unread lines of the process that contain `part`.
    pub(crate) fn lines_with(&mut self, part: &str) -> Vec<String> {
        let lines: Vec<String> = self.lines.try_iter().collect();
        self.seen.extend(lines.iter().cloned());
        lines
            .into_iter()
            .filter(|line| line.contains(part))
            .collect()
    }

    /// Waits for the relay's next agreement. Returns the f32 bits of x, y, altitude and target SIR.
    pub(crate) fn settled(&mut self) -> [u32; 4] {
        let setpoint = bits(&self.line("setpoint: "));
        let target = bits(&self.line("converged: "));
        [setpoint[0], setpoint[1], setpoint[2], target[0]]
    }

    /// Waits until the relay agrees on these bits of x, y, altitude and target SIR. Other agreements may come first.
    pub(crate) fn settles_at(&mut self, expected: [u32; 4]) {
        let mut place = Vec::new();
        loop {
            let line = self.line(" (0x");
            let mut agreed = bits(&line);
            if line.contains("setpoint: ") {
                place = agreed;
                continue;
            }
            if !line.contains("converged: ") {
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

    /// Kills the process, and waits until its files and ports are free.
    pub(crate) fn killed(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    /// Waits until the process exits. Returns its exit status and its lines.
    pub(crate) fn end(mut self) -> Ended {
        wait_until(|| self.child.try_wait().unwrap().is_some());
        let status = self.child.wait().unwrap();
        let mut stdout = std::mem::take(&mut self.seen);
        stdout.extend(self.lines.iter());
        Ended {
            status: status.code(),
            stdout,
            stderr: self.errors.iter().collect(),
        }
    }

    /// Terminates the process. Checks that it exits with status 0 and without an error. Returns its lines.
    pub(crate) fn stopped(self) -> Vec<String> {
        self.signal(Signal::TERM);
        self.succeeds()
    }

    /// Waits for the exit, with status 0 and without an error. Returns the lines of the process.
    pub(crate) fn succeeds(self) -> Vec<String> {
        let name = self.name.clone();
        let ended = self.end();
        assert_eq!(
            (ended.status, ended.stderr.len()),
            (Some(0), 0),
            "{name}: {ended:?}"
        );
        ended.stdout
    }

    /// Waits for the exit, with `status` and one error line. Returns that line.
    pub(crate) fn refused(self, status: i32) -> String {
        self.fails(status).1
    }

    /// Waits for the exit, with `status`, one error line and no other line. Returns the error line.
    pub(crate) fn refused_at_once(self, status: i32) -> String {
        let (said, error) = self.fails(status);
        assert_eq!(said, [""; 0], "{error}");
        error
    }

    /// Waits for the exit, with `status` and one error line. Returns the other lines and the error line.
    pub(crate) fn fails(self, status: i32) -> (Vec<String>, String) {
        let name = self.name.clone();
        let mut ended = self.end();
        let found = (ended.status, ended.stderr.len());
        assert_eq!(found, (Some(status), 1), "{name}: {ended:?}");
        (ended.stdout, ended.stderr.remove(0))
    }

    /// Returns the process's processor time and number of voluntary sleeps since its start.
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

    /// Prints and returns the processor time and the number of voluntary sleeps since `before`.
    pub(crate) fn cost_since(&self, before: (Duration, u64)) -> (Duration, u64) {
        let (time, sleeps) = self.cost();
        let (used, woken) = (time.saturating_sub(before.0), sleeps - before.1);
        println!(
            "{} ms of processor time, {woken} wake-ups",
            used.as_millis()
        );
        (used, woken)
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        // The process may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

pub(crate) fn words(options: &str) -> Vec<&str> {
    options.split_whitespace().collect()
}

/// Waits until the condition holds, for at most [`LIMIT`].
pub(crate) fn wait_until(mut is_so: impl FnMut() -> bool) {
    let end = Instant::now() + LIMIT;
    while !is_so() {
        assert!(Instant::now() < end, "not within {LIMIT:?}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Returns the f32 bits that a log line prints in hexadecimal, as `(0x...)`.
pub(crate) fn bits(line: &str) -> Vec<u32> {
    let mut parts = line.split("(0x");
    parts.next();
    parts
        .map(|part| u32::from_str_radix(&part[..8], 16).unwrap())
        .collect()
}
