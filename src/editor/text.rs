//! What the documentation of a field says: the text of its tooltip and its range.

use core::ops::RangeInclusive;

/// The name of a field as words.
pub(super) fn words(name: &str) -> String {
    let mut words = String::with_capacity(name.len() + 4);
    let mut was_lower = false;
    for c in name.chars() {
        if c == '_' {
            words.push(' ');
        } else if c.is_uppercase() && was_lower {
            words.push(' ');
            words.extend(c.to_lowercase());
        } else {
            words.push(c);
        }
        was_lower = c.is_lowercase();
    }
    words
}

/// A documentation comment without its markup: links are their texts, and lines of one paragraph are one line.
pub(super) fn plain(docs: &str) -> String {
    let mut text = String::with_capacity(docs.len());
    for line in docs.trim().lines() {
        let line = line.trim();
        if line.is_empty() {
            text.push_str("\n\n");
        } else {
            if !text.is_empty() && !text.ends_with('\n') {
                text.push(' ');
            }
            text.push_str(line);
        }
    }
    without_links(&text).replace('`', "")
}

/// `[text](target)` and `[text]` become `text`. Arrays such as `[0, 1]` stay: the text of a link has no comma and begins with a
/// letter or a backtick.
fn without_links(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('[') {
        plain.push_str(before);
        let link = after
            .split_once(']')
            .filter(|(label, _)| !label.contains(',') && label.starts_with(|c: char| c == '`' || c.is_alphabetic()));
        match link {
            Some((label, after)) => {
                plain.push_str(label);
                let target = after.strip_prefix('(').and_then(|target| target.split_once(')'));
                rest = target.map_or(after, |(_, after)| after);
            }
            None => {
                plain.push('[');
                rest = after;
            }
        }
    }
    plain.push_str(rest);
    plain
}

/// The range that a documentation comment names, as in `0..=1`: the last one, as ranges stand at the end.
pub(super) fn range(docs: &str) -> Option<RangeInclusive<f64>> {
    let is_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '_');
    let mut found = None;
    for (at, _) in docs.match_indices("..=") {
        let (before, after) = (&docs[..at], &docs[at + 3..]);
        let from =
            before.rfind(|c| !is_number(c)).map_or(0, |i| i + before[i..].chars().next().map_or(1, char::len_utf8));
        let to = after.find(|c| !is_number(c)).unwrap_or(after.len());
        let number = |text: &str| text.trim_end_matches('.').replace('_', "").parse::<f64>().ok();
        if let (Some(from), Some(to)) = (number(&before[from..]), number(&after[..to]))
            && from < to
        {
            found = Some(from..=to);
        }
    }
    found
}

/// The unit that a documentation comment names, as it stands behind a number.
pub(super) fn unit(docs: &str) -> &'static str {
    let first = docs.trim_start();
    for (said, unit) in [
        ("adians a second", " rad/s"),
        ("adians", " rad"),
        ("illiseconds", " ms"),
        ("teps of growth a second", " /s"),
        ("texels at", " texels"),
    ] {
        if first.contains(said) {
            return unit;
        }
    }
    ""
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_words() {
        assert_eq!(words("kill_distance"), "kill distance");
        assert_eq!(words("PseudoGrid"), "Pseudo grid");
        assert_eq!(words("StrokePairs"), "Stroke pairs");
    }

    #[test]
    fn markup_goes() {
        let docs = " Distance at which a marker is removed,\n at most [`crack_radius`](Self::crack_radius).\n\n See [the mask] and `x`, [0, 1].";
        assert_eq!(
            plain(docs),
            "Distance at which a marker is removed, at most crack_radius.\n\nSee the mask and x, [0, 1]."
        );
        assert_eq!(plain("an open [ bracket, and `code`"), "an open [ bracket, and code");
    }

    #[test]
    fn the_last_range_counts() {
        assert_eq!(range(" Pattern units, 0.0005..=4, at most [`crack_radius`]."), Some(0.0005..=4.0));
        assert_eq!(range("0 = off. -7..=7."), Some(-7.0..=7.0));
        assert_eq!(range("depth 0..=1; colour 0..=16."), Some(0.0..=16.0));
        assert_eq!(range("1..=100_000"), Some(1.0..=100_000.0));
        assert_eq!(range("each component -100..=100. Default"), Some(-100.0..=100.0));
        assert_eq!(range("no range, a..=b, 3..=1, é..=2"), None);
    }
}
