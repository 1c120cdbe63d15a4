//! Attributes as texts: a value gives the same text whatever format it was written in.

/// A value of an attribute, as a format has it.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Truth(bool),
    Whole(i64),
    /// A whole number of a type without a sign.
    Count(u64),
    Number(f64),
    Text(String),
    /// A day, its year first, with or without marks between year, month and day.
    Day(String),
    /// A day and a time of day, as ISO 8601 has it or with a space between both.
    Moment(String),
}

impl Value {
    /// A number of 32 bits, by its own shortest digits and not by those of its neighbour of 64 bits.
    #[cfg(any(test, feature = "geoparquet"))]
    pub fn single(number: f32) -> Self {
        number.to_string().parse().map_or(Value::Number(number.into()), Value::Number)
    }

    /// A number as it is written in a text, or that text where it is none.
    pub fn written(text: &str) -> Self {
        match (text.parse(), text.parse()) {
            (Ok(whole), _) => Value::Whole(whole),
            (_, Ok(number)) => Value::Number(number),
            _ => Value::Text(text.to_owned()),
        }
    }

    /// The text: whole numbers without a fraction, others by their shortest digits, `true` or `false`, days and times
    /// as ISO 8601 has them (`2020-01-31`, `2020-01-31T12:30:00`). None where it stands for no value.
    pub fn text(self) -> Option<String> {
        match self {
            Value::Truth(value) => Some(value.to_string()),
            Value::Whole(number) => Some(number.to_string()),
            Value::Count(number) => Some(number.to_string()),
            Value::Number(number) => number_text(number),
            Value::Text(text) => Some(text),
            Value::Day(text) => day_text(text.trim()),
            Value::Moment(text) => moment_text(text.trim()),
        }
    }
}

/// Powers of ten only where digits alone would be long: the same bounds as in JavaScript.
fn number_text(number: f64) -> Option<String> {
    match number.abs() {
        _ if !number.is_finite() => None,
        0.0 => Some("0".into()),
        size if (1e-6..1e21).contains(&size) => Some(number.to_string()),
        _ => Some(format!("{number:e}")),
    }
}

/// A text that is no day stays as it is; eight zeros are how tables say that there is none.
fn day_text(text: &str) -> Option<String> {
    let digits: String = text.chars().filter(|c| !matches!(c, '-' | '/')).collect();
    match digits.len() == 8 && digits.bytes().all(|byte| byte.is_ascii_digit()) {
        true if digits == "00000000" => None,
        true => Some(format!("{}-{}-{}", &digits[..4], &digits[4..6], &digits[6..])),
        false => (!text.is_empty()).then(|| text.to_owned()),
    }
}

/// Fractions of a second end at their last digit that is not zero.
fn moment_text(text: &str) -> Option<String> {
    let Some((day, rest)) = text.split_once(['T', ' ']) else { return day_text(text) };
    let ends = rest.find(|c: char| !(c.is_ascii_digit() || matches!(c, ':' | '.'))).unwrap_or(rest.len());
    let (time, zone) = rest.split_at(ends);
    let time = if time.contains('.') { time.trim_end_matches('0').trim_end_matches('.') } else { time };
    let zone = match zone.trim() {
        "+00:00" | "+00" => "Z",
        zone => zone,
    };
    Some(format!("{}T{time}{zone}", day_text(day)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(value: Value, expected: &str) {
        assert_eq!(value.clone().text().as_deref(), Some(expected), "{value:?}");
    }

    #[test]
    fn a_value_gives_one_text_however_it_is_written() {
        for whole in [Value::Whole(3), Value::Count(3), Value::Number(3.0), Value::single(3.0)] {
            check(whole, "3");
        }
        for written in ["3", "+3", "003", "3.0", "3.000000000000000", "3e0"] {
            check(Value::written(written), "3");
        }
        for number in [Value::Number(3.1), Value::single(3.1), Value::written("3.100000000000000")] {
            check(number, "3.1");
        }
        check(Value::written("1,5"), "1,5");
        check(Value::written("123456789012345678"), "123456789012345678");
        check(Value::Number(-0.0), "0");
        check(Value::Number(1e300), "1e300");
        check(Value::Number(5e-7), "5e-7");
        check(Value::Number(1e20), "100000000000000000000");
        check(Value::Truth(true), "true");
        for day in ["20200131", "2020-01-31", "2020/01/31"] {
            check(Value::Day(day.into()), "2020-01-31");
        }
        for moment in ["2020-01-31T12:30:00.000Z", "2020/01/31 12:30:00+00", "2020-01-31 12:30:00.000000 +00:00"] {
            check(Value::Moment(moment.into()), "2020-01-31T12:30:00Z");
        }
        check(Value::Moment("2020-01-31 12:30:00.250".into()), "2020-01-31T12:30:00.25");
        check(Value::Day("soon".into()), "soon");
        for none in [Value::Number(f64::NAN), Value::Day("00000000".into()), Value::Day(String::new())] {
            assert_eq!(none.text(), None);
        }
    }
}
