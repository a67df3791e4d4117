//! Requests of browsers: parsing, checks, and the files of the page.
//!
//! A request is refused unless it is a GET without a body for the address that it arrived at. The check of `Host` prevents DNS
//! rebinding: a foreign name that resolves to this computer. Requests of other sites' pages are refused if the browser marks them:
//! by `Origin`, or by `Sec-Fetch-Site`, which browsers send to loopback addresses but not to other addresses by plain HTTP. Only a
//! link to `/` may be on another site. A foreign page's request without either header is answered, and the headers of the
//! response tell the browser to keep the answer from that page.

use std::net::{IpAddr, SocketAddr};

/// Largest size of a request line with its headers, bytes.
pub(crate) const MAX_REQUEST: usize = 8 * 1024;

/// Largest number of headers of a request.
const MAX_HEADERS: usize = 64;

/// Content security policy of the page: its own files, and nothing else.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; base-uri 'none'; \
                      form-action 'none'; frame-ancestors 'none'";

/// Files of the page: path, media type and content. The path of the page itself is `/`.
pub const FILES: [(&str, &str, &str); 6] = [
    (
        "/",
        "text/html; charset=utf-8",
        include_str!("../web/index.html"),
    ),
    (
        "/screen.css",
        "text/css; charset=utf-8",
        include_str!("../web/screen.css"),
    ),
    (
        "/map.js",
        "text/javascript; charset=utf-8",
        include_str!("../web/map.js"),
    ),
    (
        "/alarms.js",
        "text/javascript; charset=utf-8",
        include_str!("../web/alarms.js"),
    ),
    (
        "/screen.js",
        "text/javascript; charset=utf-8",
        include_str!("../web/screen.js"),
    ),
    (
        "/icon.svg",
        "image/svg+xml",
        include_str!("../web/icon.svg"),
    ),
];

/// Path of the stream of snapshots.
const EVENTS: &str = "/events";

/// Answer to a request.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Answer {
    /// File of the page: media type and content.
    File(&'static str, &'static str),
    /// Stream of snapshots, which lasts until the browser leaves.
    Events,
    /// Refusal: status and reason phrase.
    Refused(u16, &'static str),
}

/// Largest-size refusal of a request.
pub(crate) const TOO_LARGE: Answer = Answer::Refused(431, "Request Header Fields Too Large");
/// Refusal of a request that did not arrive in time.
pub(crate) const TOO_SLOW: Answer = Answer::Refused(408, "Request Timeout");
/// Refusal of a connection beyond the limit of connections.
pub(crate) const FULL: Answer = Answer::Refused(503, "Service Unavailable");

const MALFORMED: Answer = Answer::Refused(400, "Bad Request");
const FOREIGN: Answer = Answer::Refused(403, "Forbidden");

/// Returns the answer to the received bytes of a request; `None` while it is incomplete.
///
/// `own` is the address at which the request arrived.
pub(crate) fn answer(bytes: &[u8], own: SocketAddr) -> Option<Answer> {
    let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    match request.parse(bytes) {
        Ok(httparse::Status::Complete(_)) => {}
        Ok(httparse::Status::Partial) => return None,
        Err(httparse::Error::TooManyHeaders) => return Some(TOO_LARGE),
        Err(_) => return Some(MALFORMED),
    }
    Some(checked(&request, own))
}

fn checked(request: &httparse::Request<'_, '_>, own: SocketAddr) -> Answer {
    let values = |name: &'static str| {
        let headers = request.headers.iter();
        let same = headers.filter(move |header| header.name.eq_ignore_ascii_case(name));
        same.map(|header| std::str::from_utf8(header.value).unwrap_or_default())
    };
    let (mut hosts, mut origins) = (values("host"), values("origin"));
    let (Some(host), None) = (hosts.next(), hosts.next()) else {
        return MALFORMED;
    };
    if !is_own(host, own) {
        return FOREIGN;
    }
    if origins.any(|origin| origin.strip_prefix("http://") != Some(host)) {
        return FOREIGN;
    }
    let target = request.path.unwrap_or_default();
    let path = target.split('?').next().unwrap_or_default();
    let is_foreign = values("sec-fetch-site").any(|site| !matches!(site, "same-origin" | "none"));
    let is_link = path == "/" && values("sec-fetch-mode").eq(["navigate"]);
    if is_foreign && !is_link {
        return FOREIGN;
    }
    if request.method != Some("GET") {
        return Answer::Refused(405, "Method Not Allowed");
    }
    let has_body = values("content-length").any(|length| length != "0")
        || values("transfer-encoding").next().is_some();
    if has_body {
        return MALFORMED;
    }
    if path == EVENTS {
        return Answer::Events;
    }
    let file = FILES.iter().find(|(name, ..)| *name == path);
    file.map_or(Answer::Refused(404, "Not Found"), |(_, media, content)| {
        Answer::File(media, content)
    })
}

/// Returns true if `host` is the address `own`, or `localhost` for a loopback address.
fn is_own(host: &str, own: SocketAddr) -> bool {
    let (name, port) = match host.rsplit_once(':') {
        // A colon inside of brackets belongs to an IPv6 address.
        Some((name, port)) if !port.ends_with(']') => (name, port.parse().ok()),
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

/// Returns the head of the response to a request, without a body for the stream of snapshots.
pub(crate) fn head(answer: Answer) -> String {
    let (status, reason, media, length) = match answer {
        Answer::File(media, content) => (200, "OK", media, Some(content.len())),
        Answer::Events => (200, "OK", "text/event-stream", None),
        Answer::Refused(status, reason) => (
            status,
            reason,
            "text/plain; charset=utf-8",
            Some(reason.len() + 1),
        ),
    };
    let length = length.map_or_else(String::new, |length| {
        format!("Content-Length: {length}\r\n")
    });
    let allow = if status == 405 { "Allow: GET\r\n" } else { "" };
    format!(
        "HTTP/1.1 {status} {reason}\r\nContent-Type: {media}\r\n{length}{allow}Connection: close\r\nCache-Control: no-store\r\n\
         Content-Security-Policy: {POLICY}\r\nX-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY\r\n\
         Referrer-Policy: no-referrer\r\nCross-Origin-Resource-Policy: same-origin\r\n\r\n"
    )
}

/// Returns the body of the response to a request; empty for the stream of snapshots.
pub(crate) fn body(answer: Answer) -> String {
    match answer {
        Answer::File(_, content) => content.to_owned(),
        Answer::Events => String::new(),
        Answer::Refused(_, reason) => format!("{reason}\n"),
    }
}

#[cfg(test)]
mod tests {
    use super::{Answer, FOREIGN, MALFORMED, TOO_LARGE, answer};

    fn asked(request: &str, own: &str) -> Option<Answer> {
        let own = own.parse().ok()?;
        answer(request.as_bytes(), own)
    }

    fn status(lines: &str) -> u16 {
        let request = format!("{lines}\r\n\r\n")
            .replace('\n', "\r\n")
            .replace("\r\r", "\r");
        match asked(&request, "127.0.0.1:8080") {
            Some(Answer::Refused(status, _)) => status,
            Some(_) => 200,
            None => 0,
        }
    }

    #[test]
    fn only_the_own_host_and_origin_get_the_page() {
        for (lines, expected) in [
            ("GET / HTTP/1.1\nHost: 127.0.0.1:8080", 200),
            ("GET /?a HTTP/1.1\nHost: localhost:8080", 200),
            (
                "GET /events HTTP/1.1\nHost: 127.0.0.1:8080\nOrigin: http://127.0.0.1:8080",
                200,
            ),
            ("GET / HTTP/1.1\nHost: 127.0.0.1", 403),
            ("GET / HTTP/1.1\nHost: 127.0.0.1:8081", 403),
            ("GET / HTTP/1.1\nHost: evil.example:8080", 403),
            ("GET / HTTP/1.1\nHost: 127.0.0.2:8080", 403),
            (
                "GET / HTTP/1.1\nHost: 127.0.0.1:8080\nOrigin: http://evil.example",
                403,
            ),
            (
                "GET / HTTP/1.1\nHost: 127.0.0.1:8080\nOrigin: https://127.0.0.1:8080",
                403,
            ),
            ("GET / HTTP/1.1\nHost: 127.0.0.1:8080\nOrigin: null", 403),
            (
                "GET / HTTP/1.1\nHost: localhost:8080\nOrigin: http://127.0.0.1:8080",
                403,
            ),
            (
                "GET / HTTP/1.1\nHost: 127.0.0.1:8080\nHost: 127.0.0.1:8080",
                400,
            ),
            ("GET / HTTP/1.1", 400),
            ("POST / HTTP/1.1\nHost: 127.0.0.1:8080", 405),
            ("HEAD / HTTP/1.1\nHost: 127.0.0.1:8080", 405),
            (
                "GET / HTTP/1.1\nHost: 127.0.0.1:8080\nContent-Length: 4",
                400,
            ),
            (
                "GET / HTTP/1.1\nHost: 127.0.0.1:8080\nTransfer-Encoding: chunked",
                400,
            ),
            ("GET /../Cargo.toml HTTP/1.1\nHost: 127.0.0.1:8080", 404),
            (
                "GET http://127.0.0.1:8080/ HTTP/1.1\nHost: 127.0.0.1:8080",
                404,
            ),
        ] {
            assert_eq!(status(lines), expected, "{lines}");
        }
    }

    #[test]
    fn foreign_pages_may_only_link_to_the_page() {
        for (path, headers, expected) in [
            ("/events", "Sec-Fetch-Site: same-origin", 200),
            ("/", "Sec-Fetch-Site: none\nSec-Fetch-Mode: navigate", 200),
            ("/icon.svg", "Sec-Fetch-Site: cross-site", 403),
            (
                "/events",
                "Sec-Fetch-Site: same-site\nSec-Fetch-Mode: no-cors",
                403,
            ),
            (
                "/events",
                "Sec-Fetch-Site: cross-site\nSec-Fetch-Mode: navigate",
                403,
            ),
            (
                "/",
                "Sec-Fetch-Site: cross-site\nSec-Fetch-Mode: no-cors",
                403,
            ),
            ("/", "Sec-Fetch-Site: cross-site", 403),
            ("/", "Sec-Fetch-Site: ", 403),
            ("/", "Sec-Fetch-Site: none\nSec-Fetch-Site: cross-site", 403),
            (
                "/?a",
                "Sec-Fetch-Site: cross-site\nSec-Fetch-Mode: navigate",
                200,
            ),
        ] {
            let lines = format!("GET {path} HTTP/1.1\nHost: 127.0.0.1:8080\n{headers}");
            assert_eq!(status(&lines), expected, "{lines}");
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
