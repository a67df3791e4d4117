//! Formatting of numbers for people.

/// Formats a whole number in groups of three digits.
pub fn spaced(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::spaced;

    #[test]
    fn thousands_stand_apart() {
        let texts = [7, 100, 4_900, 139_600, 1_000_000].map(spaced);
        assert_eq!(texts, ["7", "100", "4 900", "139 600", "1 000 000"]);
    }
}
