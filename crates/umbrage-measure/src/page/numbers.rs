//! Formats numbers for readers.

/// The text for an unknown figure.
pub(super) const UNKNOWN: &str = "–";

/// Three significant digits, with thousands grouped: `0.0132`, `4.10`, `1 230`.
pub(super) fn significant(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if value.abs() < 1e-4 {
        return format!("{value:.1e}").replace('-', "−");
    }
    // Digits are counted on the rounded value, because 9.996 becomes 10.0.
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    let decimals = (2.0 - rounded.abs().log10().floor()).max(0.0) as usize;
    let text = format!("{rounded:.decimals$}");
    match text.split_once('.') {
        Some((whole, part)) => format!("{}.{part}", grouped(whole)),
        None => grouped(&text),
    }
}

/// A share as a percentage, without the percent sign: `1.32`.
pub(super) fn percent(share: f64) -> String {
    significant(share * 100.0)
}

/// A count, with thousands grouped.
pub(super) fn count(n: u64) -> String {
    grouped(&n.to_string())
}

/// A duration in a suitable unit: `0.800 ms`, `12.3 s`, `4.50 min`.
pub(super) fn duration_ms(ms: f64) -> String {
    match ms {
        ms if ms < 1e3 => format!("{} ms", significant(ms)),
        ms if ms < 120e3 => format!("{} s", significant(ms / 1e3)),
        ms => format!("{} min", significant(ms / 60e3)),
    }
}

/// A vector such as `(1, −2.5, 0)`, rounded to three decimals.
pub(super) fn vector(v: [f64; 3]) -> String {
    format!("({})", v.map(plain).join(", "))
}

/// A number with at most three decimals and no trailing zeros.
pub(super) fn plain(value: f64) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.replace('-', "−") }
}

/// 2 to the power of `exponent`; powers below 1 as a fraction: `1/8`, `1`, `32`.
pub(super) fn power_of_two(exponent: i32) -> String {
    let power = 1_u64 << exponent.unsigned_abs();
    if exponent < 0 { format!("1/{power}") } else { power.to_string() }
}

fn grouped(digits: &str) -> String {
    let (sign, digits) = digits.strip_prefix('-').map_or(("", digits), |d| ("−", d));
    let mut text = sign.to_owned();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            // A narrow no-break space.
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        for (value, text) in [
            (0.0, "0"),
            (0.013_249, "0.0132"),
            (0.999_9, "1.00"),
            (4.1, "4.10"),
            (9.996, "10.0"),
            (99.96, "100"),
            (1234.5, "1\u{202f}230"),
            (-1.5, "−1.50"),
            (0.000_012, "1.2e−5"),
            (865_159.0, "865\u{202f}000"),
        ] {
            assert_eq!(significant(value).replace("-", "−"), text, "{value}");
        }
        assert_eq!(percent(0.0132), "1.32");
        assert_eq!(count(1_048_576), "1\u{202f}048\u{202f}576");
        assert_eq!(count(12), "12");
        assert_eq!(duration_ms(0.8), "0.800 ms");
        assert_eq!(duration_ms(12_345.0), "12.3 s");
        assert_eq!(duration_ms(600e3), "10.0 min");
        assert_eq!(vector([1.0, -2.5, -0.0001]), "(1, −2.5, 0)");
        assert_eq!([-3, 0, 5].map(power_of_two), ["1/8", "1", "32"]);
    }
}
