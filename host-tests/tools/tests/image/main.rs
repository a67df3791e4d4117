//! Flash images. Independent readers find the bytes of the ELF at their load addresses.
#![cfg(test)]

use std::process::{Command, Output};

use ihex::{Reader, Record};
use uav_relay_tools::image::{Board, Family, PAGE, Piece, flat, hex, pieces, uf2};
use uav_relay_tools::provision::config::LEN;

fn elf(segments: &[(u32, u32, &[u8])]) -> Vec<u8> {
    let count = u16::try_from(segments.len()).unwrap();
    let mut file = Vec::from(*b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0");
    let half = |file: &mut Vec<u8>, number: u16| file.extend(number.to_le_bytes());
    let word = |file: &mut Vec<u8>, number: u32| file.extend(number.to_le_bytes());
    half(&mut file, 2);
    half(&mut file, 40);
    for number in [1, 0, 52, 0, 0] {
        word(&mut file, number);
    }
    for number in [52, 32, count, 40, 0, 0] {
        half(&mut file, number);
    }
    let mut at = 52 + 32 * u32::from(count);
    for (stored, runs, bytes) in segments {
        let len = u32::try_from(bytes.len()).unwrap();
        for number in [1, at, *runs, *stored, len, len, 4, 4] {
            word(&mut file, number);
        }
        at += len;
    }
    for (_, _, bytes) in segments {
        file.extend(*bytes);
    }
    file
}

/// Returns the parts of an image: a vector table, code 70 KiB after its start, and data for RAM.
fn example() -> Vec<Piece> {
    let code: Vec<u8> = (0..70_000_u32).map(|at| (at % 251) as u8).collect();
    let file = elf(&[
        (0x1001_1800, 0x1001_1800, &code),
        (0x1000_0000, 0x1000_0000, &[1; 276]),
        (0x1003_0000, 0x2000_0000, &[9; 5]),
    ]);
    pieces(&file).unwrap()
}

#[test]
fn an_image_has_its_elfs_addresses_and_blank_gaps() {
    let whole = flat(&example()).unwrap();
    assert_eq!(whole.address, 0x1000_0000);
    assert_eq!(whole.bytes.len(), 0x3_0005);
    assert_eq!(whole.bytes[..277], [&[1; 276][..], &[0xFF]].concat());
    assert_eq!(whole.bytes[0x1_1800..][..3], [0, 1, 2]);
    assert_eq!(whole.bytes[0x3_0000..], [9; 5]);
}

#[test]
fn a_reader_of_intel_hex_finds_the_same_bytes() {
    let example = example();
    let file = hex(&example).unwrap();
    let mut found = vec![0xFF; 0x3_0005];
    let mut above = 0;
    let mut ended = false;
    for record in Reader::new(&file) {
        match record.unwrap() {
            Record::ExtendedLinearAddress(high) => above = u32::from(high) << 16,
            Record::Data { offset, value } => {
                let at = (above + u32::from(offset) - 0x1000_0000) as usize;
                found[at..at + value.len()].copy_from_slice(&value);
            }
            Record::EndOfFile => ended = true,
            other => panic!("{other:?}"),
        }
    }
    assert!(ended);
    assert_eq!(found, flat(&example).unwrap().bytes);
}

#[test]
fn a_uf2_file_has_whole_blocks_with_whole_pages() {
    let example = example();
    let file = uf2(&example, Family::RP2350).unwrap();
    let word = |block: &[u8], at: usize| u32::from_le_bytes(block[at..at + 4].try_into().unwrap());
    assert_eq!(file.len() % 512, 0);
    let count = u32::try_from(file.len() / 512).unwrap();
    // 276 bytes take 2 pages, 70 000 bytes from the start of a page take 274, and the last part takes one.
    assert_eq!(count, 2 + 274 + 1);
    let whole = flat(&example).unwrap().bytes;
    for (number, block) in (0..).zip(file.chunks_exact(512)) {
        let head = [0, 4, 8, 16, 20, 24, 28, 508].map(|at| word(block, at));
        let expected = [
            0x0A32_4655,
            0x9E5D_5157,
            0x2000,
            256,
            number,
            count,
            0xE48B_FF59,
            0x0AB1_6F30,
        ];
        assert_eq!(head, expected);
        let address = word(block, 12);
        assert_eq!(address % PAGE, 0);
        let from = (address - 0x1000_0000) as usize;
        let page: Vec<u8> = (from..from + 256)
            .map(|at| whole.get(at).copied().unwrap_or(0xFF))
            .collect();
        assert_eq!(block[32..288], page);
    }
}

#[test]
fn an_invalid_image_is_refused_in_one_line() {
    assert!(
        pieces(b"no ELF")
            .unwrap_err()
            .starts_with("not a 32-bit ELF file")
    );
    let nothing = pieces(&elf(&[])).unwrap_err();
    assert_eq!(nothing, "the ELF file has no loadable segments");
    let twice = elf(&[(0, 0, &[1; 8]), (4, 4, &[2; 8])]);
    let twice = flat(&pieces(&twice).unwrap()).unwrap_err();
    assert_eq!(twice, "two segments of the image overlap at 0x00000004");
    let far = elf(&[(0, 0, &[1]), (0x2000_0000, 0, &[2])]);
    assert!(flat(&pieces(&far).unwrap()).is_err());
}

fn image(arguments: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_image"));
    command.args(arguments.split_whitespace()).output().unwrap()
}

#[test]
fn a_block_becomes_files_and_an_invalid_one_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_string_lossy().into_owned();
    std::fs::write(path("relay3.bin"), [5; LEN]).unwrap();
    let done = image(&format!(
        "--board pico2 --block {} --out {}",
        path("relay3.bin"),
        path("out")
    ));
    assert!(done.status.success(), "{done:?}");
    let uf2 = std::fs::read(path("out/relay3.uf2")).unwrap();
    assert_eq!(uf2.len(), 2 * 512);
    assert_eq!(uf2[12..16], 0x103F_F000_u32.to_le_bytes());
    std::fs::write(path("short.bin"), [5; 7]).unwrap();
    for (arguments, says) in [
        (
            &*format!("--board pico2 --block {}", path("short.bin")),
            "has 7 bytes, but a block has 396",
        ),
        ("--board pico3", "one of stm32f405"),
        ("--board pico2 --block nowhere.bin", "nowhere.bin"),
    ] {
        let refused = image(arguments);
        let line = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{line}");
        assert!(line.contains(says) && line.lines().count() == 1, "{line}");
    }
}

/// Checks that each board's block is outside of its image, so that flashing an image keeps the block.
#[test]
fn a_boards_block_is_at_an_address_beyond_any_image() {
    let embassy = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/embassy");
    for (board, folder) in [
        ("stm32f405-embassy", "stm32f405"),
        ("nucleo-f446re", "nucleo-f446re"),
        ("pico2", "pico2"),
    ] {
        let memory = std::fs::read_to_string(embassy.join(folder).join("memory.x")).unwrap();
        let (_, length) = memory.split_once("LENGTH =").unwrap();
        let length = length.lines().next().unwrap();
        let kib = |part: &str| -> u32 { part.trim().trim_end_matches('K').parse().unwrap() };
        let kib = length.split('-').map(kib).reduce(|all, less| all - less);
        let board = Board::named(board).unwrap();
        let start = board.block & 0xFF00_0000;
        assert!(board.block >= start + 1024 * kib.unwrap(), "{}", board.name);
    }
}
