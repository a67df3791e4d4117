//! A closed output pipe does not change the exit status.

use std::process::{Command, Stdio};

fn unheard(tool: &str, arguments: &str) -> Option<i32> {
    let pipe = || {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        Stdio::from(writer)
    };
    let status = Command::new(tool)
        .args(arguments.split_whitespace())
        .stdout(pipe())
        .stderr(pipe())
        .status();
    status.unwrap().code()
}

#[test]
fn nobody_reads_and_the_status_is_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let [plan, provision, figures] = [
        env!("CARGO_BIN_EXE_plan"),
        env!("CARGO_BIN_EXE_provision"),
        env!("CARGO_BIN_EXE_figures"),
    ];
    let (block, blocks, pages) = (path("block.bin"), path("blocks"), path("figures"));
    for (tool, arguments, status) in [
        (plan, "--uavs 8", 0),
        (plan, "--uavs 8 --json", 0),
        (plan, "--help", 0),
        (plan, "--uavs x", 2),
        (plan, "--target-sir-db 60", 1),
        (provision, &format!("--uavs 3 --index 1 --out {block}"), 0),
        (provision, &format!("--uavs 3 --all --out-dir {blocks}"), 0),
        (provision, &format!("--uavs 3 --all --out-dir {blocks}"), 2),
        (provision, "--help", 0),
        (figures, &format!("--only locus --out {pages}"), 0),
        (figures, "--only none", 2),
        (figures, "--help", 0),
    ] {
        assert_eq!(
            unheard(tool, arguments),
            Some(status),
            "{tool} {arguments:?}"
        );
    }
}
