//! Server of the page. One thread accepts connections, one writes snapshots as JSON, and each connection has one.
//!
//! [`Screen::show`] only replaces the snapshot in the inbox, which no connection touches. A connection sends the newest snapshot when it
//! has sent the one before, so that a slow browser skips snapshots and delays nobody. Log lines are kept apart, because no line may
//! be skipped: each connection sends the lines that it has not sent yet, of the last [`LINES`].

use std::collections::VecDeque;
use std::fmt;
use std::hash::{BuildHasher as _, RandomState};
use std::io::{self, Read as _, Write as _};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{Builder, JoinHandle, sleep};
use std::time::{Duration, Instant};

use serde::Serialize;

use crate::ScreenError;
use crate::clean::{clean, clean_line, text};
use crate::request::{
    Access, Answer, FULL, MAX_REQUEST, TOO_LARGE, TOO_MANY, TOO_SLOW, Task, WRONG_PASSWORD, answer,
    body, head, picture, replied,
};
use crate::snapshot::{LogLine, Snapshot};

/// Largest number of open connections. Further connections get the status 503.
pub const MAX_CONNECTIONS: usize = 64;

/// Largest number of open connections from one other computer, so that several computers can connect.
pub const MAX_PER_ADDRESS: usize = 16;

/// Largest number of open streams of snapshots, so that connections remain for files and tasks.
pub const MAX_STREAMS: usize = 56;

/// Number of connections that are reserved for this computer.
const OWN: usize = 8;

/// Largest number of connections from all other computers that have not sent the password yet.
const MAX_UNKNOWN: usize = 16;

/// Largest number of connections from this computer that have not sent the password yet.
const MAX_UNKNOWN_OWN: usize = 32;

/// Largest number of connections from one other computer that have not sent the password yet.
const MAX_UNKNOWN_PER_ADDRESS: usize = 8;

/// Number of log lines that the server keeps for browsers that open the page later.
const LINES: usize = 1_000;

/// Time within which a request has to arrive.
const REQUEST_TIME: Duration = Duration::from_secs(5);

/// Time within which a browser has to receive one file or one snapshot.
const WRITE_TIME: Duration = Duration::from_secs(10);

/// Time without any received byte after which the system ends the connection of a browser.
///
/// It applies to the stream of snapshots. It begins when the browser's receive buffer is full.
const UNREAD_TIME: Duration = Duration::from_secs(20);

/// Time for which the server reads and ignores the rest of a request after its answer.
///
/// Otherwise unread bytes would reset the connection before the answer arrives at the browser.
const LINGER_TIME: Duration = Duration::from_millis(200);

/// Least time between two snapshots that browsers receive. The program may show snapshots more often.
const PAUSE: Duration = Duration::from_millis(50);

/// Time without a new snapshot after which the server sends an empty comment to a browser.
///
/// If the browser has closed the connection, sending fails.
const SILENCE: Duration = Duration::from_secs(1);

/// Largest number of tasks that wait for the program. Further tasks get the status 503.
const TASKS: usize = 4;

/// Time within which the program has to begin a task.
///
/// A program that has begun in time has the same time once more to answer the task.
const REPLY_TIME: Duration = Duration::from_secs(5);

/// Time for which the server remembers a wrong password.
const TRIES_TIME: Duration = Duration::from_secs(60);

/// Largest number of wrong passwords in [`TRIES_TIME`] from one address.
const MAX_TRIES: usize = 5;

/// Largest number of wrong passwords in [`TRIES_TIME`] from all addresses together.
///
/// When this number is reached, the server refuses the requests of all computers except its own.
const MAX_ALL_TRIES: usize = 100;

/// Stack size of a connection's thread, bytes.
///
/// It suffices to decompress a map tile. A smaller stack could overflow, which ends the program.
const STACK: usize = 1024 * 1024;

/// Pictures of the map below the chain: tiles of the Web Mercator projection from the program's file.
pub struct Tiles {
    /// Smallest and largest zoom level of the map tiles.
    pub zooms: [u8; 2],
    /// Text that names the source of the pictures; the page shows it. Empty if no source has to be named.
    pub attribution: String,
    /// Returns media type and bytes of the tile at a zoom level, column and row; `None` if there is none.
    ///
    /// Threads that serve different browsers call this function at the same time.
    pub read: Box<TileReader>,
}

/// Function that reads a map tile.
pub type TileReader = dyn Fn(u8, u32, u32) -> Option<(&'static str, Vec<u8>)> + Send + Sync;

impl fmt::Debug for Tiles {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Tiles").finish_non_exhaustive()
    }
}

/// Server of the page that shows a chain. The server ends when this value is dropped.
#[derive(Debug)]
pub struct Screen {
    shared: Arc<Shared>,
    address: SocketAddr,
    threads: Vec<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct Shared {
    /// Random identifier of this run of the program.
    ///
    /// When the page receives another identifier, it clears its alarms and the drawn paths of the drones.
    run: String,
    inbox: Mutex<Inbox>,
    is_new: Condvar,
    outbox: Mutex<Outbox>,
    is_written: Condvar,
    access: Access,
    tiles: Option<Tiles>,
    /// Channel to the program, which does the page's tasks; `None` if the page cannot give tasks.
    tasks: Option<SyncSender<Post>>,
    /// Addresses and times of wrong passwords in the last [`TRIES_TIME`].
    tries: Mutex<VecDeque<(IpAddr, Instant)>>,
    /// Remote address and state of each open connection.
    peers: Mutex<Vec<(IpAddr, Stage)>>,
    has_ended: AtomicBool,
}

/// State of a connection.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Stage {
    /// The connection has not sent a request with the right password yet.
    ///
    /// This state does not occur if the server has no password.
    Unknown,
    Known,
    /// Snapshots are being sent.
    Streaming,
}

/// Newest snapshot and log lines that are still to be converted to JSON.
#[derive(Debug, Default)]
struct Inbox {
    snapshot: Option<Snapshot>,
    lines: VecDeque<LogLine>,
}

/// Newest snapshot and log lines as JSON.
#[derive(Debug, Default)]
struct Outbox {
    /// Number of snapshots converted to JSON so far.
    number: u64,
    /// Newest snapshot in JSON, as a server-sent event.
    event: Arc<str>,
    /// Time when the newest snapshot was converted; `None` before the first snapshot.
    written: Option<Instant>,
    lines: VecDeque<Arc<str>>,
    /// Number of log lines converted to JSON so far, including lines that are no longer stored.
    line_count: u64,
}

/// Snapshot and further data, as the server sends them to browsers in JSON.
#[derive(Serialize)]
struct Sent<'a> {
    run: &'a str,
    /// Token with which the page gives tasks; `None` if the page cannot give tasks.
    token: Option<&'a str>,
    /// Map tiles of the page; `None` if there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    tiles: Option<SentTiles<'a>>,
    #[serde(flatten)]
    snapshot: &'a Snapshot,
}

#[derive(Serialize)]
struct SentTiles<'a> {
    zooms: [u8; 2],
    attribution: &'a str,
}

/// Task that a page has given to the program. The program has to [answer](Self::reply) it.
#[derive(Debug)]
pub struct Post {
    /// Kind of the task.
    pub task: Task,
    /// Body of the request, which should be JSON.
    pub body: String,
    /// Address of the browser.
    pub peer: IpAddr,
    reply: SyncSender<Result<String, String>>,
    /// True once the program has begun the task, or the server has refused it.
    ///
    /// The server refuses a task that the program has not begun in time.
    is_settled: Arc<AtomicBool>,
}

impl Post {
    /// Marks the task as begun; returns false if the program must not do it.
    ///
    /// The result is false if the server has refused the task meanwhile. If it is true, the server still waits for the
    /// reply.
    pub fn begin(&self) -> bool {
        !self.is_settled.swap(true, Ordering::SeqCst)
    }

    /// Answers the task with JSON, or with the reason why the program does not do the task. The call never waits.
    pub fn reply(self, reply: Result<String, String>) {
        // A browser may have left.
        _ = self.reply.try_send(reply);
    }
}

impl Screen {
    /// Binds `address` and serves the page there until the screen is dropped. Port 0 takes any free port.
    ///
    /// # Errors
    /// [`ScreenError`] if the address cannot be bound.
    pub fn start(address: SocketAddr) -> Result<Self, ScreenError> {
        Self::serve(address, Access::default(), None, None)
    }

    /// Starts a screen whose page can also give [tasks](Post) to the program. If `password` is given, every request has
    /// to contain it.
    ///
    /// If `tiles` are given, the page shows them as a map below the chain.
    ///
    /// # Errors
    /// [`ScreenError`] if the address cannot be bound.
    pub fn start_acting(
        address: SocketAddr,
        password: Option<String>,
        mut tiles: Option<Tiles>,
    ) -> Result<(Self, Receiver<Post>), ScreenError> {
        // The keys of a `RandomState` come from the system's random numbers.
        let random = RandomState::new();
        let token = format!("{:016x}{:016x}", random.hash_one(1), random.hash_one(2));
        let access = Access {
            password,
            token: Some(token),
        };
        if let Some(tiles) = &mut tiles {
            text(&mut tiles.attribution);
        }
        let (tasks, posts) = sync_channel(TASKS);
        Ok((Self::serve(address, access, Some(tasks), tiles)?, posts))
    }

    fn serve(
        address: SocketAddr,
        access: Access,
        tasks: Option<SyncSender<Post>>,
        tiles: Option<Tiles>,
    ) -> Result<Self, ScreenError> {
        let failed = |error| ScreenError::Bind(address, error);
        let listener = TcpListener::bind(address).map_err(failed)?;
        let mut screen = Self {
            shared: Arc::new(Shared {
                run: format!("{:016x}", RandomState::new().hash_one(0)),
                access,
                tasks,
                tiles,
                ..Shared::default()
            }),
            address: listener.local_addr().map_err(failed)?,
            threads: Vec::new(),
        };
        let shared = Arc::clone(&screen.shared);
        screen.spawn("screen: JSON", move || shared.write_snapshots())?;
        let shared = Arc::clone(&screen.shared);
        screen.spawn("screen: accept", move || accept(&listener, &shared))?;
        Ok(screen)
    }

    fn spawn(
        &mut self,
        name: &str,
        run: impl FnOnce() + Send + 'static,
    ) -> Result<(), ScreenError> {
        let thread = Builder::new().name(name.to_owned()).spawn(run);
        self.threads.push(thread.map_err(ScreenError::Thread)?);
        Ok(())
    }

    /// Passes a snapshot to the threads that serve the browsers, and does not wait for them.
    ///
    /// The snapshot replaces an earlier one that was not sent yet, but the log lines of both are sent. Before sending,
    /// the server removes positions and SIRs that are not finite, positions that are too far away, and invisible
    /// characters in texts.
    pub fn show(&self, mut snapshot: Snapshot) {
        let lines = std::mem::take(&mut snapshot.log);
        let mut inbox = lock(&self.shared.inbox);
        inbox.lines.extend(lines);
        let over = inbox.lines.len().saturating_sub(LINES);
        inbox.lines.drain(..over);
        let replaced = inbox.snapshot.replace(snapshot);
        drop(inbox);
        self.shared.is_new.notify_one();
        drop(replaced);
    }

    /// Returns the bound address, with the port that was chosen for port 0.
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Returns the address to open in a browser of this computer.
    pub fn url(&self) -> String {
        format!("http://{}/", self.reached())
    }

    /// Returns true if other computers can open the page.
    pub fn is_public(&self) -> bool {
        !self.address.ip().to_canonical().is_loopback()
    }

    /// Returns the number of open connections.
    pub fn connections(&self) -> usize {
        lock(&self.shared.peers).len()
    }

    /// Returns an address at which this computer reaches the server.
    fn reached(&self) -> SocketAddr {
        let ip = match self.address.ip() {
            IpAddr::V4(ip) if ip.is_unspecified() => Ipv4Addr::LOCALHOST.into(),
            IpAddr::V6(ip) if ip.is_unspecified() => Ipv6Addr::LOCALHOST.into(),
            ip => ip,
        };
        SocketAddr::new(ip, self.address.port())
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        self.shared.has_ended.store(true, Ordering::SeqCst);
        // The locks order this after a check of `has_ended` and before the wait that follows the check.
        drop(lock(&self.shared.inbox));
        self.shared.is_new.notify_all();
        drop(lock(&self.shared.outbox));
        self.shared.is_written.notify_all();
        // Wakes the thread that accepts connections.
        let woken = TcpStream::connect_timeout(&self.reached(), Duration::from_secs(1));
        if woken.is_ok() {
            for thread in self.threads.drain(..) {
                _ = thread.join();
            }
        }
    }
}

impl Shared {
    fn has_ended(&self) -> bool {
        self.has_ended.load(Ordering::SeqCst)
    }

    /// Converts new snapshots from the inbox to JSON in the outbox, until the server ends.
    fn write_snapshots(&self) {
        while let Some((mut snapshot, mut lines)) = self.next() {
            clean(&mut snapshot);
            lines.iter_mut().for_each(clean_line);
            let sent = Sent {
                run: &self.run,
                token: self.access.token.as_deref(),
                tiles: self.tiles.as_ref().map(|it| SentTiles {
                    zooms: it.zooms,
                    attribution: &it.attribution,
                }),
                snapshot: &snapshot,
            };
            let text = serde_json::to_string(&sent).unwrap_or_default();
            let event = format!("event: snapshot\ndata: {text}\n\n");
            let lines: Vec<Arc<str>> = lines
                .iter()
                .filter_map(|line| serde_json::to_string(line).ok())
                .map(Arc::from)
                .collect();
            let mut outbox = lock(&self.outbox);
            outbox.number += 1;
            outbox.event = event.into();
            outbox.written = Some(Instant::now());
            outbox.line_count += lines.len() as u64;
            outbox.lines.extend(lines);
            let over = outbox.lines.len().saturating_sub(LINES);
            outbox.lines.drain(..over);
            drop(outbox);
            self.is_written.notify_all();
            sleep(PAUSE);
        }
    }

    /// Waits for the next snapshot, and returns it with its log lines; `None` if the server ends.
    fn next(&self) -> Option<(Snapshot, VecDeque<LogLine>)> {
        let mut inbox = lock(&self.inbox);
        loop {
            if self.has_ended() {
                return None;
            }
            if let Some(snapshot) = inbox.snapshot.take() {
                return Some((snapshot, std::mem::take(&mut inbox.lines)));
            }
            let woken = self.is_new.wait(inbox);
            inbox = woken.unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Returns `answer`, or a refusal after too many wrong passwords from `peer` or from all addresses.
    ///
    /// Counts the wrong password if `answer` refuses one. The refusal applies to right passwords, too, but not to
    /// tasks, because their token cannot be guessed. Requests from this computer are refused only after wrong passwords
    /// from this computer, so that a tunnel to it still works.
    fn limited(&self, answer: Answer, peer: IpAddr) -> Answer {
        if self.access.password.is_none() || matches!(answer, Answer::Post(..)) {
            return answer;
        }
        let (peer, now) = (counted_as(peer), Instant::now());
        let mut tries = lock(&self.tries);
        tries.retain(|(_, at)| now.duration_since(*at) < TRIES_TIME);
        let own = tries.iter().filter(|(by, _)| *by == peer).count();
        if own >= MAX_TRIES || tries.len() >= MAX_ALL_TRIES && !peer.is_loopback() {
            return TOO_MANY;
        }
        if answer == WRONG_PASSWORD {
            tries.push_back((peer, now));
        }
        answer
    }

    /// Passes a task to the program, and returns the response with its answer.
    fn perform(&self, task: Task, content: &[u8], peer: IpAddr) -> String {
        let (reply, answer) = sync_channel(1);
        let is_settled = Arc::new(AtomicBool::new(false));
        let post = Post {
            task,
            body: String::from_utf8_lossy(content).into_owned(),
            peer,
            reply,
            is_settled: Arc::clone(&is_settled),
        };
        let is_sent = self
            .tasks
            .as_ref()
            .is_some_and(|it| it.try_send(post).is_ok());
        let answered = || {
            let late = |_| {
                // A program that has begun the task by now answers it.
                let has_begun = is_settled.swap(true, Ordering::SeqCst);
                answer.recv_timeout(if has_begun {
                    REPLY_TIME
                } else {
                    Duration::ZERO
                })
            };
            answer.recv_timeout(REPLY_TIME).or_else(late).ok()
        };
        match is_sent.then(answered).flatten() {
            Some(answer) => replied(&answer),
            None => format!("{}{}", head(FULL), body(FULL)),
        }
    }

    /// Sends snapshots and log lines to a browser, until it leaves, is too slow, or the server ends.
    fn stream(&self, stream: &mut TcpStream) -> io::Result<()> {
        let (mut sent, mut sent_lines) = (0, 0);
        while !self.has_ended() {
            let mut outbox = lock(&self.outbox);
            if outbox.number == sent {
                let woken = self.is_written.wait_timeout(outbox, SILENCE);
                outbox = woken.unwrap_or_else(PoisonError::into_inner).0;
            }
            let mut event = Arc::from(":\n\n");
            let (mut age, mut lines) = (None, Vec::new());
            if outbox.number != sent {
                sent = outbox.number;
                event = Arc::clone(&outbox.event);
                age = outbox.written.map(|at| at.elapsed().as_millis());
                let new = outbox.line_count - sent_lines;
                sent_lines = outbox.line_count;
                let kept = outbox.lines.len();
                let skipped = kept.saturating_sub(usize::try_from(new).unwrap_or(kept));
                lines.extend(outbox.lines.iter().skip(skipped).cloned());
            }
            drop(outbox);
            if let Some(age) = age {
                // A browser that connects when snapshots have stopped gets an old one.
                write_all(stream, format!("event: age\ndata: {age}\n\n").as_bytes())?;
            }
            write_all(stream, event.as_bytes())?;
            if !lines.is_empty() {
                let event = format!("event: log\ndata: [{}]\n\n", lines.join(","));
                write_all(stream, event.as_bytes())?;
            }
        }
        Ok(())
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the address under which the connections and wrong passwords of a computer are counted.
///
/// All loopback addresses count as one address. All IPv6 addresses with the same first 64 bits count as one address,
/// too.
fn counted_as(peer: IpAddr) -> IpAddr {
    let peer = peer.to_canonical();
    match peer {
        _ if peer.is_loopback() => Ipv4Addr::LOCALHOST.into(),
        IpAddr::V6(ip) => Ipv6Addr::from_bits(ip.to_bits() >> 64 << 64).into(),
        IpAddr::V4(_) => peer,
    }
}

/// Connection with its address and state. It counts toward the limits of connections until it is dropped.
struct Counted(Arc<Shared>, (IpAddr, Stage));

impl Counted {
    /// Counts a new connection from `peer`; returns `None` if the connection would exceed a limit.
    fn new(shared: &Arc<Shared>, peer: IpAddr) -> Option<Self> {
        let peer = counted_as(peer);
        let stage = match shared.access.password {
            Some(_) => Stage::Unknown,
            None => Stage::Known,
        };
        let is_own = peer.is_loopback();
        let mut peers = lock(&shared.peers);
        let same = peers.iter().filter(|(by, _)| *by == peer);
        let unknown = |(_, stage): &&(IpAddr, Stage)| *stage == Stage::Unknown;
        let like = peers.iter().filter(|(by, _)| by.is_loopback() == is_own);
        let has_room = if is_own {
            peers.len() < MAX_CONNECTIONS
        } else {
            peers.len() < MAX_CONNECTIONS - OWN
                && same.clone().count() < MAX_PER_ADDRESS
                && same.filter(unknown).count() < MAX_UNKNOWN_PER_ADDRESS
        };
        let most = if is_own { MAX_UNKNOWN_OWN } else { MAX_UNKNOWN };
        let has_room = has_room && like.filter(unknown).count() < most;
        has_room.then(|| {
            peers.push((peer, stage));
            Self(Arc::clone(shared), (peer, stage))
        })
    }

    /// Records the new state of the connection that follows from `answer`.
    ///
    /// Returns false if `answer` is a stream of snapshots, but too many streams are open.
    fn accept(&mut self, answer: Answer) -> bool {
        let stage = match answer {
            Answer::Events => Stage::Streaming,
            Answer::Refused(..) => return true,
            _ => Stage::Known,
        };
        let mut peers = lock(&self.0.peers);
        let streams = peers.iter().filter(|(_, it)| *it == Stage::Streaming);
        if stage == Stage::Streaming && streams.count() >= MAX_STREAMS {
            return false;
        }
        if let Some(own) = peers.iter_mut().find(|it| **it == self.1) {
            own.1 = stage;
        }
        self.1.1 = stage;
        true
    }
}

impl Drop for Counted {
    fn drop(&mut self) {
        let mut peers = lock(&self.0.peers);
        if let Some(at) = peers.iter().position(|it| *it == self.1) {
            peers.swap_remove(at);
        }
    }
}

/// Accepts connections until the server ends, and starts a thread for each.
fn accept(listener: &TcpListener, shared: &Arc<Shared>) {
    loop {
        let accepted = listener.accept();
        if shared.has_ended() {
            return;
        }
        let Ok((mut stream, peer)) = accepted else {
            // Too many open files, for example: connections that end will help.
            sleep(Duration::from_millis(10));
            continue;
        };
        let Some(mut counted) = Counted::new(shared, peer.ip()) else {
            // The buffer of a new connection is empty, so this does not wait.
            _ = stream.set_nonblocking(true);
            _ = stream.write_all(format!("{}{}", head(FULL), body(FULL)).as_bytes());
            _ = stream.shutdown(Shutdown::Write);
            continue;
        };
        // A connection without a thread is dropped.
        let thread = Builder::new().name("screen: browser".to_owned());
        _ = thread
            .stack_size(STACK)
            .spawn(move || _ = serve(stream, &mut counted));
    }
}

/// Reads the request of a connection, and sends the response.
fn serve(mut stream: TcpStream, counted: &mut Counted) -> io::Result<()> {
    let shared = Arc::clone(&counted.0);
    let (own, peer) = (stream.local_addr()?, stream.peer_addr()?.ip());
    let mut buffer = [0; MAX_REQUEST];
    let (answer, content) = read(&mut stream, &mut buffer, own, &shared.access)?;
    let mut answer = shared.limited(answer, peer);
    if !counted.accept(answer) {
        answer = FULL;
    }
    let response = match answer {
        Answer::Post(task, _) => shared.perform(task, content, peer).into_bytes(),
        Answer::Tile(zoom, x, y) => {
            let tiles = shared.tiles.as_ref();
            picture(tiles.and_then(|it| (it.read)(zoom, x, y)))
        }
        _ => format!("{}{}", head(answer), body(answer)).into_bytes(),
    };
    write_all(&mut stream, &response)?;
    if answer == Answer::Events {
        _ = stream.set_nodelay(true);
        end_if_unread(&stream);
        return shared.stream(&mut stream);
    }
    // The rest of a refused request is read, because unread bytes would reset the connection before the refusal arrives.
    stream.shutdown(Shutdown::Write)?;
    let until = Instant::now() + LINGER_TIME;
    let mut rest = [0; 4096];
    while read_some(&mut stream, &mut rest, until)? > 0 {}
    Ok(())
}

/// Reads a request, and returns the answer to it, with its body.
fn read<'a>(
    stream: &mut TcpStream,
    buffer: &'a mut [u8],
    own: SocketAddr,
    access: &Access,
) -> io::Result<(Answer, &'a [u8])> {
    let until = Instant::now() + REQUEST_TIME;
    let mut len = 0;
    loop {
        let room = buffer.get_mut(len..).unwrap_or_default();
        if room.is_empty() {
            return Ok((TOO_LARGE, &[]));
        }
        match read_some(stream, room, until) {
            Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(count) => len += count,
            Err(error) if is_timeout(&error) => return Ok((TOO_SLOW, &[])),
            Err(error) => return Err(error),
        }
        if answer(buffer.get(..len).unwrap_or_default(), own, access).is_some() {
            break;
        }
    }
    let answer = answer(buffer.get(..len).unwrap_or_default(), own, access);
    Ok(answer.unwrap_or((TOO_SLOW, &[])))
}

fn is_timeout(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut
    )
}

/// Returns the time left until `until`; an error if no time is left.
fn left(until: Instant) -> io::Result<Duration> {
    let left = until.saturating_duration_since(Instant::now());
    if left.is_zero() {
        return Err(io::ErrorKind::TimedOut.into());
    }
    Ok(left)
}

/// Reads the next bytes that arrive; an error if none arrive before `until`. Returns their number.
fn read_some(stream: &mut TcpStream, bytes: &mut [u8], until: Instant) -> io::Result<usize> {
    stream.set_read_timeout(Some(left(until)?))?;
    stream.read(bytes)
}

/// Lets the system end the connection if the browser receives nothing for [`UNREAD_TIME`].
///
/// Writing alone would notice it once the system's send buffer is full, which takes small snapshots many minutes.
#[cfg(target_os = "linux")]
fn end_if_unread(stream: &TcpStream) {
    let millis = u32::try_from(UNREAD_TIME.as_millis()).unwrap_or(u32::MAX);
    _ = rustix::net::sockopt::set_tcp_user_timeout(stream, millis);
}

#[cfg(not(target_os = "linux"))]
const fn end_if_unread(_: &TcpStream) {}

/// Writes all bytes; an error if the browser does not receive all of them within [`WRITE_TIME`].
fn write_all(stream: &mut TcpStream, mut bytes: &[u8]) -> io::Result<()> {
    let until = Instant::now() + WRITE_TIME;
    while !bytes.is_empty() {
        stream.set_write_timeout(Some(left(until)?))?;
        match stream.write(bytes)? {
            0 => return Err(io::ErrorKind::WriteZero.into()),
            count => bytes = bytes.get(count..).unwrap_or_default(),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::expect_used, reason = "a test fails by it")]

    use std::net::{IpAddr, Ipv4Addr};
    use std::sync::Arc;

    use super::{
        Answer, Counted, MAX_CONNECTIONS, MAX_PER_ADDRESS, MAX_STREAMS, MAX_TRIES, MAX_UNKNOWN,
        MAX_UNKNOWN_OWN, Shared, TOO_MANY, Task, WRONG_PASSWORD, lock,
    };

    #[test]
    fn one_other_computer_leaves_room_for_others() {
        let shared = Arc::<Shared>::default();
        let from = |text: &str| Counted::new(&shared, text.parse::<IpAddr>().expect(text));
        let mut first: Vec<_> = (0..MAX_PER_ADDRESS)
            .filter_map(|_| from("192.0.2.1"))
            .collect();
        assert_eq!(first.len(), MAX_PER_ADDRESS);
        assert!(from("192.0.2.1").is_none() && from("::ffff:192.0.2.1").is_none());
        let second = from("192.0.2.2").expect("room");
        // A connection that ends makes room.
        drop(first.pop());
        first.push(from("192.0.2.1").expect("room"));
        // One IPv6 network is one computer.
        let third: Vec<_> = (0..MAX_CONNECTIONS)
            .filter_map(|at| from(&format!("2001:db8::{at:x}:1")))
            .collect();
        assert_eq!(third.len(), MAX_PER_ADDRESS);
        // Loopback connections have the limit of all connections.
        let rest: Vec<_> = std::iter::from_fn(|| from("127.0.0.1")).collect();
        assert_eq!(rest.len(), MAX_CONNECTIONS - 2 * MAX_PER_ADDRESS - 1);
        drop((first, second, third, rest));
        assert!(lock(&shared.peers).is_empty());
    }

    #[test]
    fn connections_without_the_password_leave_room_for_those_with_it() {
        let mut own = Shared::default();
        own.access.password = Some("correct horse".to_owned());
        let shared = Arc::new(own);
        let from = |text: &str| Counted::new(&shared, text.parse::<IpAddr>().expect(text));
        let mut known = from("192.0.2.1").expect("room");
        assert!(known.accept(Answer::Events));
        let others: Vec<_> = (0..MAX_CONNECTIONS)
            .filter_map(|at| from(&format!("198.51.100.{}", at % 20)))
            .collect();
        assert_eq!(others.len(), MAX_UNKNOWN);
        // Also loopback connections, from any loopback address.
        let local: Vec<_> = (0..MAX_CONNECTIONS)
            .filter_map(|at| from(&format!("127.0.{at}.1")))
            .collect();
        assert_eq!(local.len(), MAX_UNKNOWN_OWN);
        drop(local);
        let mut tunnelled: Vec<_> = std::iter::from_fn(|| {
            let mut next = from("127.0.0.1")?;
            next.accept(Answer::Events).then_some(next)
        })
        .collect();
        assert_eq!(tunnelled.len(), MAX_CONNECTIONS - 1 - MAX_UNKNOWN);
        drop(others);
        tunnelled.extend(std::iter::from_fn(|| {
            let mut next = from("127.0.0.1")?;
            next.accept(Answer::Events).then_some(next)
        }));
        assert_eq!(tunnelled.len(), MAX_STREAMS - 1);
        assert!(from("127.0.0.1").is_some_and(|mut it| it.accept(Answer::Post(Task::Upload, 2))));
        drop((known, tunnelled));
        assert!(lock(&shared.peers).is_empty());
    }

    #[test]
    fn all_loopback_addresses_share_the_limit_of_wrong_passwords() {
        let mut shared = Shared::default();
        shared.access.password = Some("correct horse".to_owned());
        let refused = (0..200_u8).filter(|at| {
            let peer = Ipv4Addr::new(127, 0, 0, *at).into();
            shared.limited(WRONG_PASSWORD, peer) == TOO_MANY
        });
        assert_eq!(refused.count(), 200 - MAX_TRIES);
        assert_eq!(lock(&shared.tries).len(), MAX_TRIES);
        // A task with the token was sent by a page that had the password.
        let own = Ipv4Addr::LOCALHOST.into();
        assert_eq!(shared.limited(Answer::Events, own), TOO_MANY);
        let task = Answer::Post(Task::Upload, 2);
        assert_eq!(shared.limited(task, own), task);
    }
}
