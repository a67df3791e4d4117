//! Reads a secret from a file: a key (of the network or the autopilot) or a password.
//!
//! A key has 64 hexadecimal digits, as from `openssl rand -hex 32`.

use std::path::Path;

/// Reads the secret key in `file`. `option` is the command-line option that named the file, for error messages.
///
/// # Errors
/// A text with the option, the file and the problem, for example that other users can read the file. The text never
/// contains the content of the file.
pub fn load(option: &str, file: &Path) -> Result<[u8; 32], String> {
    parse(&read(option, file)?).map_err(|error| format!("{option} {}: {error}", file.display()))
}

/// Reads a password from the first line of `file`; `option` is the command-line option that named it.
///
/// # Errors
/// A text with the option, the file and the problem. The text never contains the content of the file.
pub fn load_password(option: &str, file: &Path) -> Result<String, String> {
    let text = read(option, file)?;
    let password = text.lines().next().unwrap_or_default().trim();
    if !(8..=200).contains(&password.chars().count()) {
        return Err(format!(
            "{option} {}: must have 8 to 200 characters in its first line",
            file.display()
        ));
    }
    Ok(password.to_owned())
}

fn read(option: &str, file: &Path) -> Result<String, String> {
    let named = |error: &str| format!("{option} {}: {error}", file.display());
    check_mode(file).map_err(|error| named(&error))?;
    std::fs::read_to_string(file).map_err(|error| named(&format!("cannot be read: {error}")))
}

/// Rejects a key file that users other than its owner and group can read or write.
///
/// Accepts a missing or unreadable file, because the caller's attempt to read such a file fails anyway.
#[cfg(unix)]
fn check_mode(file: &Path) -> Result<(), String> {
    use std::os::unix::fs::PermissionsExt as _;
    const OTHERS: u32 = 0o006;
    match std::fs::metadata(file) {
        Ok(about) if about.is_file() && about.permissions().mode() & OTHERS != 0 => {
            let mode = about.permissions().mode() & 0o777;
            Err(format!(
                "has the mode {mode:04o}, so other users of this computer can read or write it; type: chmod 600 {}",
                file.display()
            ))
        }
        _ => Ok(()),
    }
}

/// Accepts any key file, because systems other than Unix have no file mode to check.
#[cfg(not(unix))]
fn check_mode(_: &Path) -> Result<(), String> {
    Ok(())
}

/// Parses a secret key from 64 hexadecimal digits; white space around them is ignored.
///
/// # Errors
/// The problem: a character that is no digit, a wrong length, or a key of zeros.
pub fn parse(text: &str) -> Result<[u8; 32], &'static str> {
    let text = text.trim();
    if !text.bytes().all(|digit| digit.is_ascii_hexdigit()) {
        return Err("must contain only hexadecimal digits");
    }
    let mut key = [0; 32];
    if text.len() != 2 * key.len() {
        return Err("must be 64 hexadecimal digits, as printed by `openssl rand -hex 32`");
    }
    for (byte, at) in key.iter_mut().zip((0..).step_by(2)) {
        let digits = text.get(at..at + 2).unwrap_or_default();
        *byte = u8::from_str_radix(digits, 16).unwrap_or_default();
    }
    if key == [0; 32] {
        return Err("must not be all 0");
    }
    Ok(key)
}
