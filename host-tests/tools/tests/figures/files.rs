//! Output files, the page that links them, and error messages.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use roxmltree::{Document, Node};
use tempfile::TempDir;
use uav_relay_tools::figures::ALL;

use super::{figures, written};

fn files() -> BTreeSet<String> {
    let all = fs::read_dir(written()).unwrap();
    let name =
        |file: std::io::Result<fs::DirEntry>| file.unwrap().file_name().into_string().unwrap();
    all.map(name).filter(|name| name != "index.html").collect()
}

#[test]
fn every_figure_is_written_and_the_page_names_every_file() {
    let files = files();
    for figure in ALL {
        assert!(
            files.contains(&format!("{}.svg", figure.name)),
            "{}",
            figure.name
        );
        assert!(
            files.contains(&format!("{}.csv", figure.name)),
            "{}",
            figure.name
        );
    }
    assert_eq!(files.len(), ALL.len() + 20, "{files:?}");
    let page = fs::read_to_string(written().join("index.html")).unwrap();
    let named = |attribute: &str, ending: &str| -> BTreeSet<String> {
        let opening = format!("{attribute}=\"");
        page.split(&opening)
            .skip(1)
            .map(|rest| rest.split('"').next().unwrap().to_owned())
            .filter(|name| name.ends_with(ending))
            .collect()
    };
    let linked: BTreeSet<String> = named("src", ".svg")
        .union(&named("href", ".csv"))
        .cloned()
        .collect();
    assert_eq!(linked, files);
}

#[test]
fn no_file_contains_nan_or_infinity() {
    for file in files().iter().chain([&"index.html".to_owned()]) {
        let text = fs::read_to_string(written().join(file)).unwrap();
        let words = text.split(|c: char| !c.is_alphanumeric());
        for word in words {
            assert!(
                !matches!(word, "NaN" | "inf" | "infinity"),
                "{word} in {file}"
            );
        }
    }
}

#[test]
fn tables_state_their_scenario_and_units() {
    let bare = [
        "relays",
        "relay",
        "round",
        "sweep",
        "scene",
        "agreements",
        "field",
        "alpha",
        "beta",
        "density",
        "reading",
    ];
    let units = [
        "_m",
        "_mps",
        "_w",
        "_linear",
        "_db",
        "_percent",
        "_hz",
        "_i_max",
        "_sweeps",
        "_messages",
        "_bytes",
        "_passes",
    ];
    let is_table = |file: &&String| Path::new(file).extension().is_some_and(|end| end == "csv");
    for file in files().iter().filter(is_table) {
        let text = fs::read_to_string(written().join(file)).unwrap();
        let comments = text
            .lines()
            .take_while(|line| line.starts_with("# "))
            .count();
        assert!(comments >= 2, "{file}");
        let head = text.lines().nth(comments).unwrap();
        for name in head.split(',') {
            let has_unit = units.iter().any(|unit| name.ends_with(unit));
            assert!(has_unit || bare.contains(&name), "{name} in {file}");
        }
    }
}

/// Returns the left and right end of a text in an SVG picture, px.
///
/// A letter counts as 0.6 times as wide as the font size.
fn extent(text: &Node<'_, '_>) -> (f64, f64) {
    let number = |name: &str| text.attribute(name).unwrap().parse::<f64>().unwrap();
    let letters = text.text().unwrap().trim().chars().count() as f64;
    let width = 0.6 * number("font-size") * letters;
    let x = number("x");
    match text.attribute("text-anchor").unwrap() {
        "start" => (x, x + width),
        "end" => (x - width, x),
        _ => (x - width / 2.0, x + width / 2.0),
    }
}

#[test]
fn pictures_are_valid_and_their_text_is_inside() {
    for figure in ALL {
        let text = fs::read_to_string(written().join(format!("{}.svg", figure.name))).unwrap();
        let document = Document::parse(&text).unwrap();
        let root = document.root_element();
        let title = root.first_element_child().unwrap();
        assert_eq!(title.tag_name().name(), "title");
        assert!(title.text().is_some_and(|words| words.len() > 10));
        let size = |name: &str| root.attribute(name).unwrap().parse::<f64>().unwrap();
        let mut words = 0;
        for text in document
            .descendants()
            .filter(|node| node.has_tag_name("text"))
        {
            let y: f64 = text.attribute("y").unwrap().parse().unwrap();
            assert!(y >= 0.0 && y <= size("height"), "{:?}", text.text());
            // At least 6 points if the picture is printed 8 cm wide.
            let height: f64 = text.attribute("font-size").unwrap().parse().unwrap();
            assert!(height / size("width") * 8.0 / 2.54 * 72.0 > 6.0, "{height}");
            if text.attribute("transform").is_none() {
                let (from, to) = extent(&text);
                assert!(
                    from >= 0.0 && to <= size("width"),
                    "{:?} in {}",
                    text.text(),
                    figure.name
                );
            }
            words += 1;
        }
        assert!(words > 8, "{}", figure.name);
        let drawn = document
            .descendants()
            .filter(|node| node.has_tag_name("polyline"))
            .count();
        assert!(drawn > 2, "{}", figure.name);
    }
}

#[test]
fn a_second_run_writes_the_same_bytes() {
    let dir = TempDir::new().unwrap();
    let arguments = format!(
        "--out {} --only locus --only gain --only stochastic --only rounds",
        dir.path().display()
    );
    let output = figures(&arguments);
    assert!(output.status.success());
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.starts_with("4 figures and 5 tables in "), "{said}");
    assert!(said.trim_end().ends_with("index.html"), "{said}");
    let mut compared = 0;
    for file in fs::read_dir(dir.path()).unwrap() {
        let name = file.unwrap().file_name();
        if name == "index.html" {
            continue;
        }
        let (again, first) = (dir.path().join(&name), written().join(&name));
        assert_eq!(
            fs::read(again).unwrap(),
            fs::read(first).unwrap(),
            "{name:?}"
        );
        compared += 1;
    }
    assert_eq!(compared, 4 + 5);
    let page = fs::read_to_string(dir.path().join("index.html")).unwrap();
    assert!(page.contains("gain.svg") && !page.contains("joint.svg"));
}

#[test]
fn a_wrong_figure_name_lists_the_right_ones() {
    let output = figures("--only locus --only nothing");
    assert_eq!(output.status.code(), Some(2));
    assert!(output.stdout.is_empty());
    let line = String::from_utf8(output.stderr).unwrap();
    assert_eq!(line.trim_end().lines().count(), 1, "{line}");
    assert!(
        line.contains("--only") && line.contains("'nothing'"),
        "{line}"
    );
    for figure in ALL {
        assert!(line.contains(figure.name), "{line}");
    }
}

#[test]
fn an_unwritable_folder_is_named() {
    let dir = TempDir::new().unwrap();
    let file = dir.path().join("file");
    fs::write(&file, "").unwrap();
    let output = figures(&format!("--only beta --out {}", file.display()));
    assert_eq!(output.status.code(), Some(2));
    let line = String::from_utf8(output.stderr).unwrap();
    assert_eq!(line.trim_end().lines().count(), 1, "{line}");
    assert!(line.contains("--out") && line.contains("file"), "{line}");
}

#[test]
fn help_lists_the_figures() {
    let output = figures("--help");
    assert!(output.status.success());
    let help = String::from_utf8(output.stdout).unwrap();
    assert!(
        ALL.iter().all(|figure| help.contains(figure.name)),
        "{help}"
    );
}

#[test]
fn the_page_begins_with_its_contents() {
    let page = fs::read_to_string(written().join("index.html")).unwrap();
    let (contents, rest) = page.split_once("</nav>").unwrap();
    for figure in ALL {
        let name = figure.name;
        assert!(
            contents.contains(&format!("<a href=\"#{name}\">")),
            "{name}"
        );
        assert!(rest.contains(&format!("<figure id=\"{name}\">")), "{name}");
    }
    assert!(!contents.contains("<figure"), "the contents come first");
}

#[test]
fn every_finished_figure_is_reported() {
    let folder = TempDir::new().unwrap();
    let names = [ALL[0].name, ALL[1].name];
    let out = folder.path().to_str().unwrap();
    let output = figures(&format!(
        "--out {out} --only {} --only {}",
        names[0], names[1]
    ));
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stderr).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 2, "{text}");
    assert!(lines[0].starts_with("1 of 2 figures: ") && lines[1].starts_with("2 of 2 figures: "));
    for name in names {
        assert!(
            lines
                .iter()
                .any(|line| line.ends_with(&format!(": {name}"))),
            "{text}"
        );
    }
}
