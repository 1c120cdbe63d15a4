//! Days and moments of Parquet, which are numbers there, as texts.

use parquet::basic::{ConvertedType, LogicalType, TimeUnit};
use parquet::record::Field;
use parquet::schema::types::Type;

use super::value::Value;

/// Days since 1970 of the years from 0 to 9999: texts of others, which the library cannot all write, are none.
const DAYS: std::ops::Range<i64> = -719_528..2_932_897;
const DAY_MICROS: i64 = 86_400_000_000;

/// How a column counts moments since 1970.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    in_a_second: i64,
    /// Whether it counts them in UTC, and not wherever they were.
    is_utc: bool,
}

impl Clock {
    /// That of a column of moments.
    pub fn of(column: &Type) -> Option<Self> {
        let info = column.get_basic_info();
        let (in_a_second, is_utc) = match (info.logical_type_ref(), info.converted_type()) {
            (Some(LogicalType::Timestamp(moments)), _) => {
                let in_a_second = match moments.unit {
                    TimeUnit::MILLIS => 1_000,
                    TimeUnit::MICROS => 1_000_000,
                    TimeUnit::NANOS => 1_000_000_000,
                };
                (in_a_second, moments.is_adjusted_to_u_t_c)
            }
            (_, ConvertedType::TIMESTAMP_MILLIS) => (1_000, true),
            (_, ConvertedType::TIMESTAMP_MICROS) => (1_000_000, true),
            _ => return None,
        };
        Some(Self { in_a_second, is_utc })
    }

    /// The text of one of its values.
    pub fn text(self, field: &Field) -> Option<String> {
        let (Field::Long(count) | Field::TimestampMillis(count) | Field::TimestampMicros(count)) = *field else {
            return None;
        };
        let micros = i128::from(count) * 1_000_000;
        let micros = i64::try_from(micros.div_euclid(self.in_a_second.into())).ok()?;
        DAYS.contains(&micros.div_euclid(DAY_MICROS)).then_some(())?;
        // The library writes `2020-01-31 12:30:00.000000 +00:00`, whether that is in UTC or not.
        let text = Field::TimestampMicros(micros).to_string();
        let text = if self.is_utc { text } else { text.trim_end_matches(" +00:00").to_owned() };
        Value::Moment(text).text()
    }
}

/// The text of a day.
pub(super) fn day_text(days: i32) -> Option<String> {
    DAYS.contains(&days.into()).then(|| Value::Day(Field::Date(days).to_string()).text()).flatten()
}
