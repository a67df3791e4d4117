//! Page of a flight: the screen's page in one file, with the report, a time bar and all snapshots.

use std::fmt::Write as _;

use base64::Engine as _;
use serde_json::json;
use sha2::{Digest as _, Sha256};
use uav_relay_screen::FILES;

use crate::clocks::Alignment;
use crate::flight::{Flight, Loss};

const SCRIPT: &str = include_str!("../web/replay.js");
const STYLE: &str = include_str!("../web/replay.css");
const BAR: &str = include_str!("../web/bar.html");

/// Width and height of the chart, and its left and bottom margins, px.
const CHART: [f64; 4] = [1000.0, 180.0, 44.0, 22.0];

/// Returns the page of a flight as a single HTML document that loads no other files.
pub fn page(flight: &Flight, files: &[Alignment], warnings: &[String]) -> String {
    let file = |name: Option<&str>| {
        let mut files = FILES.iter();
        let file = files.find(|(path, ..)| Some(*path) == name);
        file.map_or(("", ""), |(_, media, content)| (*media, *content))
    };
    let (mut head, mut scripts, mut hashes) = (String::new(), String::new(), String::new());
    let (mut index, mut style) = (String::new(), String::new());
    // The screen's page names each of its files on a line of its own.
    for line in file(Some("/")).1.lines() {
        let (media, content) = file(line.split('"').find(|part| part.starts_with('/')));
        match media.split(';').next() {
            Some("text/javascript") => script(content, &mut scripts, &mut hashes),
            Some("text/css") => style.push_str(content),
            Some("image/svg+xml") => head.push_str("<link rel=\"icon\" href=\"data:,\">\n"),
            _ => {
                index.push_str(line);
                index.push('\n');
            }
        }
    }
    style.push_str(STYLE);
    script(SCRIPT, &mut scripts, &mut hashes);
    let policy = format!(
        "default-src 'none'; img-src data:; script-src {hashes}; style-src 'sha256-{}'; base-uri 'none'; form-action 'none'",
        hash(&style)
    );
    let head = format!(
        "<meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n{head}<style>{style}</style>\n</head>"
    );
    let data = json!({
        "begin": flight.begin,
        "duration": flight.duration,
        "period": flight.period,
        "steps": flight.steps,
        "log": flight.log,
        "alarms": flight.alarms,
    });
    // No text in the data can end the script element.
    let data = data.to_string().replace('<', "\\u003c");
    let data = format!("<script type=\"application/json\" id=\"flight\">{data}</script>\n");
    index
        .replacen("</head>", &head, 1)
        .replacen(
            "</main>",
            &format!("</main>\n{}", report(flight, files, warnings)),
            1,
        )
        .replacen("</body>", &format!("{BAR}{data}{scripts}</body>"), 1)
}

fn script(content: &str, scripts: &mut String, hashes: &mut String) {
    _ = writeln!(scripts, "<script>{content}</script>");
    _ = write!(hashes, " 'sha256-{}'", hash(content));
}

fn hash(content: &str) -> String {
    base64::prelude::BASE64_STANDARD.encode(Sha256::digest(content))
}

fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    text.replace('>', "&gt;").replace('"', "&quot;")
}

/// Formats a time of the flight as a button that shows the flight at this time.
fn time(at: f64) -> String {
    format!(
        "<button type=\"button\" class=\"time\" data-time=\"{at:.1}\">{}</button>",
        clock(at)
    )
}

fn clock(at: f64) -> String {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "seconds of a flight"
    )]
    let whole = at as u64;
    format!(
        "{:02}:{:02}:{:02}",
        whole / 3_600,
        whole / 60 % 60,
        whole % 60
    )
}

/// Returns the report of a flight as a section of the page.
fn report(flight: &Flight, files: &[Alignment], warnings: &[String]) -> String {
    let mut rows = String::new();
    let mut row = |name: &str, value: String| {
        _ = writeln!(
            rows,
            "<tr><th scope=\"row\">{name}</th><td>{value}</td></tr>"
        );
    };
    row(
        "Flight",
        format!(
            "{} relays, {} from <span id=\"begin\"></span>",
            flight.relays,
            clock(flight.duration)
        ),
    );
    row(
        "Availability",
        match flight.available {
            None => {
                "0 % of the time: there was no time at which all relays had agreed and reported"
                    .to_owned()
            }
            Some((at, shares)) => {
                let [every, members] = shares.map(|share| (share * 1_000.0).floor() / 10.0);
                format!(
                    "{every:.1} % of the time since {}: all {} relays had agreed, and had reported within 5 s; {members:.1} % of the time: at least as many relays as the last view has members",
                    time(at),
                    flight.relays
                )
            }
        },
    );
    let known = flight
        .worst_db
        .iter()
        .enumerate()
        .filter_map(|(step, db)| Some((step, (*db)?)));
    let worst = known
        .clone()
        .min_by(|(_, one), (_, other)| one.total_cmp(other));
    row(
        "Worst hop",
        worst.map_or_else(
            || "SIR unknown: needs the mission (<code>--scenario</code>)".to_owned(),
            |(step, db)| format!("{db:.1} dB at {}", time(flight.time_of(step))),
        ),
    );
    row(
        "Nearest distance",
        flight.nearest.map_or_else(
            || "unknown: no two relays in the air have reported their positions".to_owned(),
            |it| {
                format!(
                    "{:.1} m, relays {} and {}, at {}",
                    it.distance_m,
                    it.relays[0],
                    it.relays[1],
                    time(it.time_s)
                )
            },
        ),
    );
    row("Losses", listed(flight.losses.iter().map(loss)));
    row(
        "Membership changes",
        listed(
            flight.views.iter().map(|(at, number, relays)| {
                format!("{}: {relays} relays (view {number})", time(*at))
            }),
        ),
    );
    row(
        "Files",
        listed(files.iter().map(|file| {
            let [least, most] = file.offset_s;
            let clock = match file.common {
                None => "reference clock".to_owned(),
                Some(0) => "own clock".to_owned(),
                Some(common) => format!(
                    "clock corrected by {least:+.3} to {most:+.3} s, computed from {common} frames that other files also have"
                ),
            };
            format!("{}: {clock}", escaped(&file.name))
        })),
    );
    if !warnings.is_empty() {
        row("Warnings", listed(warnings.iter().map(|it| escaped(it))));
    }
    format!(
        "<section id=\"report\" aria-labelledby=\"report-title\">\n<h2 id=\"report-title\">Report of the flight</h2>\n<table>{rows}</table>\n{}</section>\n",
        if worst.is_some() {
            chart(flight, known)
        } else {
            String::new()
        }
    )
}

fn listed(lines: impl Iterator<Item = String>) -> String {
    let lines: Vec<String> = lines.collect();
    if lines.is_empty() {
        "none".to_owned()
    } else {
        lines.join("<br>")
    }
}

fn loss(loss: &Loss) -> String {
    let whom = match loss.relay {
        0 => "all relays".to_owned(),
        relay => format!("relay {relay}"),
    };
    let until = loss.until.map_or_else(
        || "until the end".to_owned(),
        |until| format!("for {:.1} s", until - loss.from),
    );
    let by = if loss.is_reported {
        ", reported as lost by a neighbour"
    } else {
        ""
    };
    format!("{}: {whom}, no report {until}{by}", time(loss.from))
}

/// Draws the SIR of the worst hop over time as SVG, with a line at 0 dB.
fn chart(flight: &Flight, known: impl Iterator<Item = (usize, f64)> + Clone) -> String {
    let [width, height, left, bottom] = CHART;
    let bounds = known
        .clone()
        .fold([0.0_f64, 0.0_f64], |[least, most], (_, db)| {
            [least.min(db), most.max(db)]
        });
    let step = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0]
        .into_iter()
        .find(|it| (bounds[1] - bounds[0]) / it <= 6.0)
        .unwrap_or(100.0);
    let [least, most] = [
        (bounds[0] / step).floor() * step,
        ((bounds[1] / step).ceil() * step).max(step),
    ];
    let x = |at: f64| left + at / flight.duration.max(1.0) * (width - left - 10.0);
    let y = |db: f64| 8.0 + (most - db) / (most - least) * (height - bottom - 8.0);
    let (mut marks, mut line, mut last) = (String::new(), String::new(), None);
    let mut db = least;
    while db <= most {
        let kind = if db == 0.0 { " class=\"zero\"" } else { "" };
        _ = write!(
            marks,
            "<path{kind} d=\"M{left} {0:.1}H{1}\"/><text x=\"{2}\" y=\"{3:.1}\" text-anchor=\"end\">{db:.0}</text>",
            y(db),
            width - 10.0,
            left - 6.0,
            y(db) + 4.0
        );
        db += step;
    }
    let every = [10.0, 30.0, 60.0, 300.0, 600.0, 1_800.0, 3_600.0]
        .into_iter()
        .find(|it| flight.duration / it <= 10.0)
        .unwrap_or_else(|| 7_200.0 * (flight.duration / 19.0 / 7_200.0).ceil());
    let mut at = 0.0;
    while at <= flight.duration {
        _ = write!(
            marks,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            x(at).max(24.0),
            height - 4.0,
            clock(at)
        );
        at += every;
    }
    for (step, db) in known {
        let letter = if last.is_some_and(|last| last + 1 == step) {
            'L'
        } else {
            'M'
        };
        _ = write!(line, "{letter}{:.1} {:.1}", x(flight.time_of(step)), y(db));
        last = Some(step);
    }
    format!(
        "<h2>SIR of the worst hop, dB</h2>\n<div class=\"scrolled\" tabindex=\"0\" role=\"region\" aria-label=\"Chart of the SIR\"><svg id=\"chart\" viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"SIR of the worst hop over time\">{marks}<path class=\"sir\" d=\"{line}\"/><path id=\"cursor\" d=\"M0 8V{:.1}\"/></svg></div>\n",
        height - bottom
    )
}
