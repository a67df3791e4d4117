//! Requests of browsers: parsing, checks, and the files of the page.
//!
//! A request is refused unless it is for the address that it arrived at, with the password if there is one, and is a GET without a body or
//! a POST with the page's token. The check of `Host` prevents DNS rebinding: a foreign name that resolves to this computer.
//! Requests of other sites' pages are refused if the browser marks them: by `Origin`, or by `Sec-Fetch-Site`, which browsers send to
//! loopback addresses but not to other addresses by plain HTTP. Only a link to `/` may be on another site, and only without a password. A foreign page's GET without
//! either header is answered, and the headers of the response tell the browser to keep the answer from that page. A POST must have an
//! `Origin`, a JSON body, and the token, which only pages of this server can read; a foreign page's POST would first need a permission
//! (CORS) that no answer gives.

use std::fmt;
use std::hash::{BuildHasher as _, RandomState};
use std::net::{IpAddr, SocketAddr};
use std::str::FromStr;
use std::sync::LazyLock;

/// Largest size of a request, bytes.
pub(crate) const MAX_REQUEST: usize = 8 * 1024;

/// Largest size of the body of a POST, bytes.
const MAX_BODY: usize = 4 * 1024;

/// Largest number of headers of a request.
const MAX_HEADERS: usize = 64;

/// Content security policy of the page.
///
/// It permits only files of this server and the style sheet that is embedded in the page.
static POLICY: LazyLock<String> = LazyLock::new(|| {
    format!(
        "default-src 'none'; script-src 'self'; style-src 'nonce-{}'; img-src 'self'; connect-src 'self'; base-uri 'none'; \
         form-action 'none'; frame-ancestors 'none'",
        *NONCE
    )
});

/// Random text that permits the style sheet embedded in the page.
///
/// It is both in the page and in the content security policy, and the browser compares the two.
static NONCE: LazyLock<String> =
    LazyLock::new(|| format!("{:016x}", RandomState::new().hash_one(0)));

/// The page with its style sheet embedded, so that the browser can draw it after a single request.
static PAGE: LazyLock<String> = LazyLock::new(|| {
    let [(_, _, page), (_, _, style), ..] = FILES;
    let style = format!("<style nonce=\"{}\">\n{style}</style>", *NONCE);
    page.replacen("<link rel=\"stylesheet\" href=\"/screen.css\">", &style, 1)
});

/// Returns the entry in [`FILES`] of a file in the folder `web`.
macro_rules! file {
    ($name:literal, $kind:literal) => {
        (
            concat!("/", $name),
            $kind,
            include_str!(concat!("../web/", $name)),
        )
    };
}

/// Files of the page: path, media type and content. The path of the page itself is `/`.
pub const FILES: [(&str, &str, &str); 8] = [
    (
        "/",
        "text/html; charset=utf-8",
        include_str!("../web/index.html"),
    ),
    file!("screen.css", "text/css; charset=utf-8"),
    file!("map.js", "text/javascript; charset=utf-8"),
    file!("profile.js", "text/javascript; charset=utf-8"),
    file!("alarms.js", "text/javascript; charset=utf-8"),
    file!("desk.js", "text/javascript; charset=utf-8"),
    file!("screen.js", "text/javascript; charset=utf-8"),
    file!("icon.svg", "image/svg+xml"),
];

/// Path of the stream of snapshots.
const EVENTS: &str = "/events";

/// Start of a map tile's path; the rest of the path is `ZOOM/X/Y`.
const TILES: &str = "/tiles/";

/// Largest zoom level of a map tile.
const MAX_ZOOM: u8 = 24;

/// Path of a POST, by its task.
const TASKS: [(&str, Task); 3] = [
    ("/preview", Task::Preview),
    ("/upload", Task::Upload),
    ("/clear", Task::Clear),
];

/// Task that a page gives to the program that serves it, for example a ground station.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Task {
    /// Computes where the relays would fly with the mission parameters in the request's body.
    Preview,
    /// Uploads a mission that a preview has shown. The request's body contains the preview's number and digest.
    Upload,
    /// Clears the lost relay whose number is in the request's body.
    Clear,
}

/// Password and token that the server expects in requests.
#[derive(Default)]
pub(crate) struct Access {
    /// Password of all requests, with any user name; `None` if no password is needed. It is sent by HTTP basic
    /// authentication.
    pub(crate) password: Option<String>,
    /// Token that every POST request has to contain; `None` if the server accepts no POST request.
    pub(crate) token: Option<String>,
}

impl fmt::Debug for Access {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Access").finish_non_exhaustive()
    }
}

/// Answer to a request.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Answer {
    /// File of the page: media type and content.
    File(&'static str, &'static str),
    /// Stream of snapshots, which lasts until the browser closes the connection.
    Events,
    /// Map tile: zoom level, column and row.
    Tile(u8, u32, u32),
    /// Task that the program answers, and the size of the request's body, bytes.
    Post(Task, usize),
    /// Refusal: HTTP status and reason phrase.
    Refused(u16, &'static str),
}

/// Refusal of a request that is too large or has too many headers.
pub(crate) const TOO_LARGE: Answer = Answer::Refused(431, "Request Header Fields Too Large");
/// Refusal of a request that did not arrive in time.
pub(crate) const TOO_SLOW: Answer = Answer::Refused(408, "Request Timeout");
/// Refusal if too many connections, streams or tasks are open, or if a task is not answered.
pub(crate) const FULL: Answer = Answer::Refused(503, "Service Unavailable");
/// Refusal of a request without a password.
const NO_PASSWORD: Answer = Answer::Refused(401, "Unauthorized");
/// Refusal of a request with a wrong password.
pub(crate) const WRONG_PASSWORD: Answer = Answer::Refused(401, "Wrong Password");
/// Refusal of requests after too many wrong passwords.
pub(crate) const TOO_MANY: Answer = Answer::Refused(429, "Too Many Wrong Passwords");

const NO_TOKEN: Answer =
    Answer::Refused(403, "Forbidden: Token Of An Earlier Start, Reload The Page");
const BODY_TOO_LARGE: Answer = Answer::Refused(413, "Content Too Large");

const MALFORMED: Answer = Answer::Refused(400, "Bad Request");
const FOREIGN: Answer = Answer::Refused(403, "Forbidden");

/// Returns the answer to the request in `bytes`, and its body; `None` while the request is incomplete.
///
/// `own` is the local address at which the request arrived.
pub(crate) fn answer<'a>(
    bytes: &'a [u8],
    own: SocketAddr,
    access: &Access,
) -> Option<(Answer, &'a [u8])> {
    let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    let refused = |answer| Some((answer, &[][..]));
    let head = match request.parse(bytes) {
        Ok(httparse::Status::Complete(len)) => len,
        Ok(httparse::Status::Partial) => return None,
        Err(httparse::Error::TooManyHeaders) => return refused(TOO_LARGE),
        Err(_) => return refused(MALFORMED),
    };
    let answer = checked(&request, own, access);
    let Answer::Post(_, len) = answer else {
        return refused(answer);
    };
    let body = bytes.get(head..).unwrap_or_default();
    match body.len() {
        _ if head + len > MAX_REQUEST => refused(BODY_TOO_LARGE),
        received if received < len => None,
        received if received > len => refused(MALFORMED),
        _ => Some((answer, body)),
    }
}

fn checked(request: &httparse::Request<'_, '_>, own: SocketAddr, access: &Access) -> Answer {
    let values = |name: &'static str| {
        let headers = request.headers.iter();
        let same = headers.filter(move |header| header.name.eq_ignore_ascii_case(name));
        same.map(|header| std::str::from_utf8(header.value).unwrap_or_default())
    };
    let only = |name| {
        let mut all = values(name);
        all.next().filter(|_| all.next().is_none())
    };
    let Some(host) = only("host") else {
        return MALFORMED;
    };
    if !is_own(host, own) {
        return FOREIGN;
    }
    let is_own_page = |origin: &str| origin.strip_prefix("http://") == Some(host);
    if !values("origin").all(is_own_page) {
        return FOREIGN;
    }
    let target = request.path.unwrap_or_default();
    let path = target.split('?').next().unwrap_or_default();
    let is_foreign = values("sec-fetch-site").any(|site| !matches!(site, "same-origin" | "none"));
    // With a password a link could carry a wrong one, which would count as a try of this browser.
    let is_link =
        path == "/" && values("sec-fetch-mode").eq(["navigate"]) && access.password.is_none();
    if is_foreign && !is_link {
        return FOREIGN;
    }
    if let Some(password) = &access.password {
        match only("authorization") {
            None => return NO_PASSWORD,
            Some(given) if !has_password(given, password) => return WRONG_PASSWORD,
            Some(_) => {}
        }
    }
    let length = only("content-length").and_then(whole);
    let is_chunked = values("transfer-encoding").next().is_some();
    if let (Some("POST"), Some(token)) = (request.method, &access.token) {
        let task = TASKS.into_iter().find(|(of, _)| *of == path);
        let Some((_, task)) = task else {
            return Answer::Refused(404, "Not Found");
        };
        if only("origin").is_none() {
            return FOREIGN;
        }
        let given = only("x-relay-token").unwrap_or_default();
        if !is_same(given.as_bytes(), token.as_bytes()) {
            return NO_TOKEN;
        }
        return match length {
            _ if is_chunked || only("content-type") != Some("application/json") => MALFORMED,
            None => MALFORMED,
            Some(length) if length > MAX_BODY => BODY_TOO_LARGE,
            Some(length) => Answer::Post(task, length),
        };
    }
    if request.method != Some("GET") {
        return Answer::Refused(405, "Method Not Allowed");
    }
    if is_chunked || values("content-length").any(|length| length != "0") {
        return MALFORMED;
    }
    if path == EVENTS {
        return Answer::Events;
    }
    if let Some((zoom, x, y)) = path.strip_prefix(TILES).and_then(tile) {
        return Answer::Tile(zoom, x, y);
    }
    let file = FILES.iter().find(|(name, ..)| *name == path);
    file.map_or(
        Answer::Refused(404, "Not Found"),
        |(path, media, content)| {
            let content = if *path == "/" { &**PAGE } else { content };
            Answer::File(media, content)
        },
    )
}

/// Parses a whole number that consists of digits only.
fn whole<T: FromStr>(text: &str) -> Option<T> {
    let is_plain = text.bytes().all(|it| it.is_ascii_digit());
    text.parse().ok().filter(|_| is_plain)
}

/// Parses the rest of a map tile's path, `ZOOM/X/Y`; `None` if there is no such tile.
fn tile(path: &str) -> Option<(u8, u32, u32)> {
    let parts: Option<Vec<u32>> = path.split('/').map(whole).collect();
    let &[zoom, x, y] = parts.as_deref()? else {
        return None;
    };
    let zoom = u8::try_from(zoom).ok().filter(|it| *it <= MAX_ZOOM)?;
    (x.max(y) < 1 << zoom).then_some((zoom, x, y))
}

/// Returns true if an `Authorization` header has the password, with any user name.
fn has_password(header: &str, password: &str) -> bool {
    let given = header.split_once(' ');
    let given = given.filter(|(scheme, _)| scheme.eq_ignore_ascii_case("basic"));
    let given = given
        .and_then(|(_, text)| decoded(text.trim()))
        .unwrap_or_default();
    let mut parts = given.splitn(2, |byte| *byte == b':').skip(1);
    is_same(parts.next().unwrap_or_default(), password.as_bytes())
}

/// Decodes a base64 text; `None` if it contains a character that is not base64.
fn decoded(text: &str) -> Option<Vec<u8>> {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let (mut bits, mut count, mut bytes) = (0, 0, Vec::new());
    for digit in text.trim_end_matches('=').bytes() {
        let value = DIGITS.iter().position(|it| *it == digit)?;
        (bits, count) = ((bits << 6 | value) & 0xFFF, count + 6);
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count).to_le_bytes()[0]);
        }
    }
    Some(bytes)
}

/// Returns true if `given` is the secret. The time does not depend on the number of right bytes.
fn is_same(given: &[u8], secret: &[u8]) -> bool {
    let pairs = given.iter().zip(secret);
    let wrong = pairs.fold(given.len() ^ secret.len(), |wrong, (one, other)| {
        wrong | usize::from(one ^ other)
    });
    std::hint::black_box(wrong) == 0
}

/// Returns true if `host` is the address `own`, or `localhost` for a loopback address.
fn is_own(host: &str, own: SocketAddr) -> bool {
    let (name, port) = match host.rsplit_once(':') {
        // A colon inside of brackets belongs to an IPv6 address.
        Some((name, port)) if !port.ends_with(']') => (name, whole(port)),
        _ => (host, Some(80)),
    };
    if port != Some(own.port()) {
        return false;
    }
    let ip = own.ip().to_canonical();
    if name.eq_ignore_ascii_case("localhost") {
        return ip.is_loopback();
    }
    let plain = name.strip_prefix('[').and_then(|it| it.strip_suffix(']'));
    let named: Option<IpAddr> = plain.unwrap_or(name).parse().ok();
    named.is_some_and(|named| named.to_canonical() == ip)
}

/// Returns the status line and the headers of the response to a request.
///
/// The stream of snapshots has no length in its headers, because its body has no end.
pub(crate) fn head(answer: Answer) -> String {
    match answer {
        Answer::File(media, content) => written(200, "OK", media, Some(content.len())),
        Answer::Events | Answer::Tile(..) | Answer::Post(..) => {
            written(200, "OK", "text/event-stream", None)
        }
        Answer::Refused(status, reason) => written(status, reason, PLAIN, Some(reason.len() + 1)),
    }
}

/// Returns the response with a map tile. Without a tile its status is 204, which browsers do not log as an error.
pub(crate) fn picture(tile: Option<(&str, Vec<u8>)>) -> Vec<u8> {
    let (status, reason, media, content) = match tile {
        Some((media, content)) => (200, "OK", media, content),
        None => (204, "No Content", PLAIN, Vec::new()),
    };
    let mut response = written(status, reason, media, Some(content.len())).into_bytes();
    response.extend(content);
    response
}

/// Returns the HTTP response with the program's reply to a task.
///
/// The response has the status 200 with the JSON text of the reply, or 409 with the reason why the program does not do
/// the task.
pub(crate) fn replied(reply: &Result<String, String>) -> String {
    let (status, reason, media, text) = match reply {
        Ok(json) => (200, "OK", "application/json", json),
        Err(why) => (409, "Conflict", PLAIN, why),
    };
    format!("{}{text}", written(status, reason, media, Some(text.len())))
}

const PLAIN: &str = "text/plain; charset=utf-8";

fn written(status: u16, reason: &str, media: &str, length: Option<usize>) -> String {
    let length = length.map_or_else(String::new, |length| {
        format!("Content-Length: {length}\r\n")
    });
    let more = match status {
        401 => "WWW-Authenticate: Basic realm=\"relay chain\", charset=\"UTF-8\"\r\n",
        405 => "Allow: GET\r\n",
        _ => "",
    };
    format!(
        "HTTP/1.1 {status} {reason}\r\nContent-Type: {media}\r\n{length}{more}Connection: close\r\nCache-Control: no-store\r\n\
         Content-Security-Policy: {}\r\nX-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY\r\n\
         Referrer-Policy: no-referrer\r\nCross-Origin-Resource-Policy: same-origin\r\n\r\n",
        *POLICY
    )
}

/// Returns the body of the response to a request; empty for the stream of snapshots.
pub(crate) fn body(answer: Answer) -> String {
    match answer {
        Answer::File(_, content) => content.to_owned(),
        Answer::Events | Answer::Tile(..) | Answer::Post(..) => String::new(),
        Answer::Refused(_, reason) => format!("{reason}\n"),
    }
}

#[cfg(test)]
mod tests {
    use super::{Access, Answer, FOREIGN, MALFORMED, TOO_LARGE, Task, answer, decoded};

    fn asked(request: &str, own: &str) -> Option<Answer> {
        let own = own.parse().ok()?;
        answer(request.as_bytes(), own, &Access::default()).map(|(answer, _)| answer)
    }

    fn status(lines: &str) -> u16 {
        status_of(&format!("{lines}\n\n"), &Access::default())
    }

    /// Returns the HTTP status of the answer to `request`: 200 if accepted, 0 if `request` is incomplete.
    fn status_of(request: &str, access: &Access) -> u16 {
        let request = request.replace('\n', "\r\n");
        let own = ([127, 0, 0, 1], 8080).into();
        match answer(request.as_bytes(), own, access) {
            Some((Answer::Refused(status, _), _)) => status,
            Some(_) => 200,
            None => 0,
        }
    }

    #[test]
    fn a_task_needs_the_token_the_origin_and_a_small_json_body() {
        let access = Access {
            password: None,
            token: Some("secret".to_owned()),
        };
        let good = "POST /preview HTTP/1.1\nHost: 127.0.0.1:8080\nOrigin: http://127.0.0.1:8080\nX-Relay-Token: secret\n\
                    Content-Type: application/json\nContent-Length: 2\n\n{}";
        let own = ([127, 0, 0, 1], 8080).into();
        let bytes = good.replace('\n', "\r\n");
        let parsed = answer(bytes.as_bytes(), own, &access);
        assert_eq!(parsed, Some((Answer::Post(Task::Preview, 2), &b"{}"[..])));
        assert_eq!(
            status_of(good, &Access::default()),
            405,
            "a page that only shows"
        );
        for (part, with, expected) in [
            ("/preview", "/upload", 200),
            ("/preview", "/events", 404),
            ("POST", "PUT", 405),
            ("Host: 127.0.0.1:8080", "Host: evil.example:8080", 403),
            ("Origin: http://127.0.0.1:8080\n", "", 403),
            ("Origin: http://127", "Origin: http://evil.example", 403),
            ("Origin: http", "Origin: https", 403),
            ("Token: secret", "Token: secreT", 403),
            ("Token: secret", "Token: secret1", 403),
            ("X-Relay-Token: secret\n", "", 403),
            (
                "X-Relay-Token: secret\n",
                "X-Relay-Token: secret\nX-Relay-Token: secret\n",
                403,
            ),
            ("application/json", "text/plain", 400),
            ("Content-Length: 2", "Content-Length: 1", 400),
            ("Content-Length: 2", "Content-Length: 3", 0),
            ("Content-Length: 2", "Content-Length: 4097", 413),
            ("Content-Length: 2", "Content-Length: -2", 400),
            ("Content-Length: 2", "Content-Length: +2", 400),
            ("Content-Length: 2", "Transfer-Encoding: chunked", 400),
            ("Origin", "Sec-Fetch-Site: cross-site\nOrigin", 403),
        ] {
            let request = good.replacen(part, with, 1);
            assert_eq!(status_of(&request, &access), expected, "{request}");
        }
    }

    #[test]
    fn with_a_password_every_request_needs_it() {
        let access = Access {
            password: Some("correct horse: 7".to_owned()),
            token: Some("secret".to_owned()),
        };
        // The user name is any: `operator` and none.
        for (header, expected) in [
            ("", 401),
            (
                "Authorization: Basic b3BlcmF0b3I6Y29ycmVjdCBob3JzZTogNw==\n",
                200,
            ),
            ("Authorization: basic OmNvcnJlY3QgaG9yc2U6IDc=\n", 200),
            ("Authorization: Basic OmNvcnJlY3QgaG9yc2U6IDg=\n", 401),
            ("Authorization: Basic Og==\n", 401),
            ("Authorization: Basic\n", 401),
            ("Authorization: Bearer OmNvcnJlY3QgaG9yc2U6IDc=\n", 401),
            ("Authorization: Basic ?mNvcnJlY3QgaG9yc2U6IDc=\n", 401),
        ] {
            for path in ["/", "/events", "/icon.svg"] {
                let request = format!("GET {path} HTTP/1.1\nHost: 127.0.0.1:8080\n{header}\n");
                assert_eq!(status_of(&request, &access), expected, "{request}");
            }
        }
        assert_eq!(decoded("YQ==").as_deref(), Some(&b"a"[..]));
        assert_eq!(decoded("YWI/").as_deref(), Some(&b"ab?"[..]));
    }

    #[test]
    fn only_the_own_host_and_origin_get_the_page() {
        for row in [
            "200 GET / HTTP/1.1\nHost: 127.0.0.1:8080",
            "200 GET /?a HTTP/1.1\nHost: localhost:8080",
            "200 GET /events HTTP/1.1\nHost: 127.0.0.1:8080\nOrigin: http://127.0.0.1:8080",
            "403 GET / HTTP/1.1\nHost: 127.0.0.1",
            "403 GET / HTTP/1.1\nHost: 127.0.0.1:8081",
            "403 GET / HTTP/1.1\nHost: 127.0.0.1:+8080",
            "403 GET / HTTP/1.1\nHost: evil.example:8080",
            "403 GET / HTTP/1.1\nHost: 127.0.0.2:8080",
            "403 GET / HTTP/1.1\nHost: 127.0.0.1:8080\nOrigin: http://evil.example",
            "403 GET / HTTP/1.1\nHost: 127.0.0.1:8080\nOrigin: https://127.0.0.1:8080",
            "403 GET / HTTP/1.1\nHost: 127.0.0.1:8080\nOrigin: null",
            "403 GET / HTTP/1.1\nHost: localhost:8080\nOrigin: http://127.0.0.1:8080",
            "400 GET / HTTP/1.1\nHost: 127.0.0.1:8080\nHost: 127.0.0.1:8080",
            "400 GET / HTTP/1.1",
            "405 POST / HTTP/1.1\nHost: 127.0.0.1:8080",
            "405 HEAD / HTTP/1.1\nHost: 127.0.0.1:8080",
            "400 GET / HTTP/1.1\nHost: 127.0.0.1:8080\nContent-Length: 4",
            "400 GET / HTTP/1.1\nHost: 127.0.0.1:8080\nTransfer-Encoding: chunked",
            "404 GET /../Cargo.toml HTTP/1.1\nHost: 127.0.0.1:8080",
            "404 GET http://127.0.0.1:8080/ HTTP/1.1\nHost: 127.0.0.1:8080",
        ] {
            let (expected, lines) = row.split_once(' ').unwrap();
            assert_eq!(status(lines).to_string(), expected, "{lines}");
        }
    }

    #[test]
    fn foreign_pages_may_only_link_to_the_page() {
        for row in [
            "200 /events Sec-Fetch-Site: same-origin",
            "200 / Sec-Fetch-Site: none\nSec-Fetch-Mode: navigate",
            "403 /icon.svg Sec-Fetch-Site: cross-site",
            "403 /events Sec-Fetch-Site: same-site\nSec-Fetch-Mode: no-cors",
            "403 /events Sec-Fetch-Site: cross-site\nSec-Fetch-Mode: navigate",
            "403 / Sec-Fetch-Site: cross-site\nSec-Fetch-Mode: no-cors",
            "403 / Sec-Fetch-Site: cross-site",
            "403 / Sec-Fetch-Site: ",
            "403 / Sec-Fetch-Site: none\nSec-Fetch-Site: cross-site",
            "200 /?a Sec-Fetch-Site: cross-site\nSec-Fetch-Mode: navigate",
        ] {
            let [expected, path, headers] = row.splitn(3, ' ').collect::<Vec<_>>()[..] else {
                panic!("{row}");
            };
            let lines = format!("GET {path} HTTP/1.1\nHost: 127.0.0.1:8080\n{headers}");
            assert_eq!(status(&lines).to_string(), expected, "{lines}");
        }
    }

    #[test]
    fn a_tile_has_a_zoom_level_a_column_and_a_row() {
        let own = "127.0.0.1:80";
        let asked = |path: &str| {
            asked(
                &format!("GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"),
                own,
            )
        };
        assert_eq!(
            asked("/tiles/14/8622/5744"),
            Some(Answer::Tile(14, 8_622, 5_744))
        );
        assert_eq!(asked("/tiles/0/0/0"), Some(Answer::Tile(0, 0, 0)));
        for path in [
            "/tiles/14/16384/0",
            "/tiles/0/0/1",
            "/tiles/25/0/0",
            "/tiles/280/0/0",
            "/tiles/1/1",
            "/tiles/1/1/1/1",
            "/tiles/1/1/1.png",
            "/tiles/1/+1/1",
            "/tiles/1//1",
            "/tiles/../../etc/passwd",
            "/tiles/3/4294967297/0",
        ] {
            assert_eq!(
                asked(path),
                Some(Answer::Refused(404, "Not Found")),
                "{path}"
            );
        }
    }

    #[test]
    fn a_name_of_the_local_network_is_not_localhost() {
        let get = |host: &str| format!("GET /events HTTP/1.1\r\nHost: {host}\r\n\r\n");
        let own = "192.168.1.5:8080";
        assert_eq!(asked(&get("192.168.1.5:8080"), own), Some(Answer::Events));
        assert_eq!(asked(&get("localhost:8080"), own), Some(FOREIGN));
        assert_eq!(
            asked(&get("[::1]:8080"), "[::1]:8080"),
            Some(Answer::Events)
        );
        assert_eq!(asked(&get("[::1]"), "[::1]:80"), Some(Answer::Events));
        assert_eq!(
            asked(&get("127.0.0.1:9"), "[::ffff:127.0.0.1]:9"),
            Some(Answer::Events)
        );
    }

    #[test]
    fn incomplete_and_malformed_requests_are_told_apart() {
        let own = "127.0.0.1:80";
        assert_eq!(asked("GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n", own), None);
        assert_eq!(asked("\0\0\0", own), Some(MALFORMED));
        let many = "A: 1\r\n".repeat(65);
        let request = format!("GET / HTTP/1.1\r\n{many}\r\n");
        assert_eq!(asked(&request, own), Some(TOO_LARGE));
    }
}
