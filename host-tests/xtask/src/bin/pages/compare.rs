//! Compares the output in a page with the actual output.

/// Checks that the page's lines occur in the output in order. In a noisy block each number matches any number.
///
/// # Errors
/// The first missing line, and the most similar line of the output.
pub(crate) fn compare(page: &[&str], output: &str, noisy: bool) -> Result<(), String> {
    let read = |line: &str| {
        if noisy {
            unnumbered(line)
        } else {
            line.trim_end().to_owned()
        }
    };
    let mut left = output.lines();
    for line in page.iter().filter(|line| line.trim() != "...") {
        let wanted = read(line);
        if wanted.is_empty() {
            continue;
        }
        let rest = left.clone();
        if !left.any(|printed| read(printed) == wanted) {
            let like = rest.max_by_key(|printed| alike(&read(printed), &wanted));
            return Err(format!(
                "is not printed: {line}\n  most like it is: {}",
                like.unwrap_or_default()
            ));
        }
    }
    Ok(())
}

/// Replaces each number by `#`, and each run of spaces by one.
fn unnumbered(line: &str) -> String {
    let (mut out, mut in_number) = (String::new(), false);
    for sign in line.trim_end().chars() {
        let is_part = sign.is_ascii_digit() || in_number && sign == '.';
        if is_part && !in_number {
            out.push('#');
        }
        let is_repeated = sign == ' ' && out.ends_with(' ');
        if !is_part && !is_repeated {
            out.push(sign);
        }
        in_number = is_part;
    }
    out
}

/// Returns the number of words of one line that are in the other.
fn alike(one: &str, other: &str) -> usize {
    let words: Vec<&str> = other.split_whitespace().collect();
    let common = one.split_whitespace().filter(|word| words.contains(word));
    common.count()
}

#[cfg(test)]
mod tests {
    use super::compare;

    const OUTPUT: &str = "  0.10 s  one\nother \n 12.5 s  two\n";

    #[test]
    fn lines_come_in_their_order_and_numbers_count_unless_they_are_noisy() {
        let good: [&[&str]; 3] = [&["other"], &["  0.10 s  one", "...", " 12.5 s  two"], &[]];
        for page in good {
            assert_eq!(compare(page, OUTPUT, false), Ok(()));
        }
        let bad: [&[&str]; 3] = [
            &["  0.11 s  one"],
            &[" 12.5 s  two", "other"],
            &["other", "other"],
        ];
        for page in bad {
            assert!(compare(page, OUTPUT, false).is_err(), "{page:?}");
        }
        assert!(compare(&[" 9.99 s  one", " 3 s  three"], OUTPUT, true).is_err());
        assert_eq!(
            compare(&[" 9.99 s  one", " 3 s  two"], OUTPUT, true),
            Ok(())
        );
        let error = compare(&["13 s  two"], OUTPUT, false)
            .err()
            .unwrap_or_default();
        assert!(error.ends_with(" 12.5 s  two"), "{error}");
    }
}
