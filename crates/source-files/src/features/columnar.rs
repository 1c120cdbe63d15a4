//! Lines and polygons from GeoParquet, row group by row group, with its columns as tags; those of Overture as the tags
//! of OpenStreetMap that they stand for.

use std::collections::BTreeMap;
use std::sync::Arc;

use parquet::basic::{ConvertedType, Repetition, Type as Physical};
use parquet::record::{Field, Row};
use parquet::schema::types::Type;

use super::columns::{Texts, with_packed_tags};
use super::curves::Chords;
use super::model::{FeatureFile, Wanted, file_name};
use super::moments::{Clock, day_text};
use super::overture::{self, Holds, Rule};
use super::placing::{Placing, look_like_degrees};
use super::raw::{Part, RawFeature, RawShape};
use super::value::Value;
use super::well_known::binary;
use crate::SourceError;
use crate::crs::Crs;
use crate::geoparquet::GeoParquet;
use crate::store::Store;

/// Columns in columns that are read.
const DEPTH_MAX: usize = 8;

/// The footer of the file.
pub(super) fn footer(store: &Store) -> Result<GeoParquet, SourceError> {
    let mut handle = store.handle()?;
    GeoParquet::read(store.path(), store.len(), &mut |start, count| {
        store.bytes_at(&mut handle, start, count as usize).map_err(std::io::Error::other)
    })
}

/// Whom to name beside anything drawn from it.
pub(super) fn attribution(file: &GeoParquet) -> Option<&'static str> {
    is_overture(file.schema()).then_some(overture::ATTRIBUTION)
}

/// The row groups of a file that may hold something of what is wanted: all where nothing says where they lie.
///
/// # Errors
/// When its coordinates cannot be brought to the area's system.
pub fn groups_near(file: &GeoParquet, wanted: &Wanted) -> Result<Vec<usize>, SourceError> {
    let placing = Placing::new(file.path(), file.bytes(), wanted, wanted.system(|| file.system())?)?;
    Ok(near(file, &placing).0)
}

/// The row groups near the area, and the others.
fn near(file: &GeoParquet, placing: &Placing) -> (Vec<usize>, Vec<usize>) {
    (0..file.group_count()).partition(|&group| file.extent(group).is_none_or(|extent| placing.is_near(&extent)))
}

pub(super) fn read(store: &Store, wanted: &Wanted) -> Result<FeatureFile, SourceError> {
    let file = footer(store)?;
    let is_overture = is_overture(file.schema());
    let columns =
        projection(&file, is_overture).map_err(|found| store.malformed("the table", found, "a column of binary"))?;
    let said = wanted.system(|| match file.system()? {
        Some(crs) => Ok(Some(crs)),
        None => Ok(looks(&file, &columns)?.then(Crs::wgs84)),
    })?;
    let chords = Chords::of(said.as_ref());
    let mut placing = Placing::new(store.path(), store.file_bytes(), wanted, said)?;
    let (groups, others) = near(&file, &placing);
    for group in others {
        placing.count_outside(file.rows_of(group));
        file.extent(group).iter().for_each(|extent| placing.lies_over(extent));
    }
    let has = |name: &str| columns.get_fields().iter().any(|field| field.name() == name);
    let holds = is_overture.then(|| Holds::of(has));
    let (name, mut texts, mut before) = (file_name(store), Texts::default(), 0_u64);
    let clocks: Clocks =
        columns.get_fields().iter().filter_map(|field| Some((field.name().to_owned(), Clock::of(field)?))).collect();
    file.rows(&groups, &columns, &mut |_, row| {
        before += 1;
        let row = Columns::of(row, file.column(), &clocks);
        let id = match row.text("id").filter(|id| is_overture && !id.is_empty()) {
            Some(id) => id.to_owned(),
            None => format!("{name}#{}", before - 1),
        };
        // A feature without a geometry is legal and adds nothing.
        let Some(geometry) = &row.geometry else { return Ok(()) };
        match binary(geometry, chords) {
            Ok(shape) => {
                if placing.is_shape_near(&shape) {
                    place(&mut placing, &mut texts, (id, shape), &row, holds);
                }
            }
            Err(found) => placing.unread(&id, found),
        }
        placing.allowance().check()
    })?;
    placing.finish(attribution(&file))
}

/// Whether the first places of a file that names no system look like degrees.
fn looks(file: &GeoParquet, columns: &Type) -> Result<bool, SourceError> {
    const LOOKED_AT: usize = 1000;
    let is_geometry = |field: &&Arc<Type>| field.name() == file.column();
    let geometry: Vec<Arc<Type>> = columns.get_fields().iter().filter(is_geometry).cloned().collect();
    let geometry = Type::group_type_builder(file.schema().name()).with_fields(geometry).build();
    let geometry = geometry.expect("a part of the columns that are read is sound");
    let (mut vertices, first) = (Vec::new(), usize::from(0 < file.group_count()));
    let groups: Vec<usize> = (0..first).collect();
    file.rows(&groups, &geometry, &mut |_, row| {
        if vertices.len() < LOOKED_AT
            && let Some(bytes) = Columns::of(row, file.column(), &Clocks::new()).geometry
        {
            vertices.extend(
                binary(&bytes, Chords::of(None)).iter().flat_map(|shape| shape.vertices()).take(LOOKED_AT).copied(),
            );
        }
        Ok(())
    })?;
    Ok(look_like_degrees(vertices.into_iter()))
}

/// Places a feature, a segment of Overture in the parts along which its rules hold.
fn place(
    placing: &mut Placing,
    texts: &mut Texts,
    (id, shape): (String, RawShape),
    row: &Columns,
    holds: Option<Holds>,
) {
    let mut put = |id: String, shape: RawShape, said: &[(String, String)]| {
        let tags = with_packed_tags(said.iter().map(|(key, value)| (key.as_str(), value.as_str())));
        let tags = texts.tags(tags);
        texts.count(placing.allowance());
        placing.place(RawFeature { id, tags, shape });
    };
    let Some(holds) = holds else { return put(id, shape, &row.said) };
    let form = [
        shape.parts.iter().any(|part| matches!(part, Part::Line(_))),
        shape.parts.iter().any(|part| matches!(part, Part::Polygon(_))),
    ];
    let tags = overture::tags(holds, &|name| row.text(name), form);
    let parts = overture::parts(&tags, &row.rules);
    match (parts.as_slice(), shape.parts.as_slice()) {
        ([_, _, ..], [Part::Line(line)]) if 2 <= line.len() => {
            for ((between, said), number) in parts.iter().zip(1..) {
                let own = vec![Part::Line(overture::cut(line, *between))];
                put(format!("{id}:{number}"), RawShape { parts: own, ..RawShape::default() }, said);
            }
        }
        _ => put(id, shape, parts.first().map_or(tags.as_slice(), |(_, said)| said.as_slice())),
    }
}

fn is_overture(schema: &Type) -> bool {
    overture::MARKS.iter().all(|name| schema.get_fields().iter().any(|field| field.name() == *name))
}

/// The columns of a file that are read: its geometries, and those of one value; of Overture those that are looked at.
fn projection(file: &GeoParquet, is_overture: bool) -> Result<Type, String> {
    let is_wanted = |field: &Type| {
        let name = field.name();
        match () {
            () if name == file.column() => true,
            () if is_overture && overture::PLAIN.contains(&name) => is_value(field),
            () if is_overture => overture::RULES.iter().any(|(rules, _)| *rules == name) && is_read(field, 0),
            () => is_value(field),
        }
    };
    let mut names: Vec<&str> = Vec::new();
    let mut fields: Vec<Arc<Type>> = Vec::new();
    for field in file.schema().get_fields() {
        // Of two columns with one name neither library nor tags could tell which is which.
        if is_wanted(field) && !names.contains(&field.name()) {
            names.push(field.name());
            fields.push(field.clone());
        }
    }
    let geometry = fields.iter().find(|field| field.name() == file.column());
    let is_binary = geometry.is_some_and(|field| {
        let is_once =
            field.get_basic_info().has_repetition() && field.get_basic_info().repetition() != Repetition::REPEATED;
        let is_plain = is_once && field.get_basic_info().converted_type() == ConvertedType::NONE;
        is_plain && field.is_primitive() && field.get_physical_type() == Physical::BYTE_ARRAY
    });
    if !is_binary {
        return Err(format!("no column `{}` of binary", file.column()));
    }
    Type::group_type_builder(file.schema().name()).with_fields(fields).build().map_err(|error| error.to_string())
}

/// Whether a column holds one value of a kind that becomes a text.
fn is_value(field: &Type) -> bool {
    use ConvertedType as C;
    let info = field.get_basic_info();
    field.is_primitive()
        && info.has_repetition()
        && info.repetition() != Repetition::REPEATED
        && matches!(
            (field.get_physical_type(), info.converted_type()),
            (Physical::BOOLEAN | Physical::FLOAT | Physical::DOUBLE, C::NONE)
                | (Physical::BYTE_ARRAY, C::UTF8 | C::ENUM)
                | (Physical::INT32, C::DATE)
                | (Physical::INT64, C::TIMESTAMP_MILLIS | C::TIMESTAMP_MICROS)
                | (Physical::INT32, C::NONE | C::INT_8 | C::INT_16 | C::INT_32 | C::UINT_8 | C::UINT_16 | C::UINT_32)
                | (Physical::INT64, C::NONE | C::INT_64 | C::UINT_64)
        )
}

/// Whether a column is of values, structures and lists that the library can read: it takes the form of others as given.
fn is_read(field: &Type, depth: usize) -> bool {
    let info = field.get_basic_info();
    let is_once = info.has_repetition() && info.repetition() != Repetition::REPEATED;
    if field.is_primitive() {
        return is_value(field);
    }
    let fields = field.get_fields();
    let all = |fields: &[Arc<Type>]| !fields.is_empty() && fields.iter().all(|field| is_read(field, depth + 1));
    is_once
        && depth < DEPTH_MAX
        && match (info.converted_type(), fields) {
            (ConvertedType::LIST, [list]) => {
                let is_list = list.is_group() && list.get_basic_info().repetition() == Repetition::REPEATED;
                is_list && list.get_basic_info().converted_type() == ConvertedType::NONE && all(list.get_fields())
            }
            (ConvertedType::NONE, fields) => all(fields),
            _ => false,
        }
}

/// How columns of moments count, by their names.
type Clocks = BTreeMap<String, Clock>;

/// A row, taken apart.
struct Columns {
    geometry: Option<Vec<u8>>,
    said: Vec<(String, String)>,
    rules: Vec<Rule>,
}

impl Columns {
    fn of(row: Row, geometry: &str, clocks: &Clocks) -> Self {
        let mut own = Self { geometry: None, said: Vec::new(), rules: Vec::new() };
        for (name, field) in row.into_columns() {
            match field {
                Field::Bytes(bytes) if name == geometry => own.geometry = Some(bytes.data().to_vec()),
                field if clocks.contains_key(&name) => {
                    own.said.extend(clocks[&name].text(&field).map(|text| (name, text)));
                }
                field => match (text_of(&field), overture::RULES.iter().find(|(rules, _)| *rules == name)) {
                    (Some(text), _) => own.said.push((name, text)),
                    (None, Some((column, _))) => own.rules.extend(rules_of(column, &field)),
                    (None, None) => {}
                },
            }
        }
        if let (Some(subclass), true) = (own.text("subclass"), own.rules.iter().all(|rule| rule.column != SUBCLASSES)) {
            own.rules.push(Rule { column: SUBCLASSES, value: subclass.to_owned(), between: [0.0, 1.0] });
        }
        own
    }

    fn text(&self, name: &str) -> Option<&str> {
        self.said.iter().find(|(key, _)| key == name).map(|(_, text)| text.as_str())
    }
}

const SUBCLASSES: &str = "subclass_rules";

/// A value as a tag's.
fn text_of(field: &Field) -> Option<String> {
    let value = match *field {
        Field::Str(ref text) => Value::Text(text.clone()),
        Field::Bool(value) => Value::Truth(value),
        Field::Byte(number) => Value::Whole(number.into()),
        Field::Short(number) => Value::Whole(number.into()),
        Field::Int(number) => Value::Whole(number.into()),
        Field::Long(number) => Value::Whole(number),
        Field::UByte(number) => Value::Count(number.into()),
        Field::UShort(number) => Value::Count(number.into()),
        Field::UInt(number) => Value::Count(number.into()),
        Field::ULong(number) => Value::Count(number),
        Field::Float(number) => Value::single(number),
        Field::Double(number) => Value::Number(number),
        Field::Date(days) => return day_text(days),
        _ => return None,
    };
    value.text()
}

/// The rules in a column of them: each has a value or a list of values, and mostly two numbers between which it holds.
fn rules_of(column: &'static str, field: &Field) -> Vec<Rule> {
    let Field::ListInternal(list) = field else { return Vec::new() };
    let mut rules = Vec::new();
    for element in list.elements() {
        let Field::Group(row) = element else { continue };
        let (mut values, mut between) = (Vec::new(), [0.0, 1.0]);
        for (name, field) in row.get_column_iter() {
            match (name.as_str(), field) {
                ("between", Field::ListInternal(list)) => {
                    if let [Field::Double(from), Field::Double(to)] = *list.elements() {
                        between = [from, to];
                    }
                }
                ("value", field) => values.extend(text_of(field)),
                ("values", Field::ListInternal(list)) => values.extend(list.elements().iter().filter_map(text_of)),
                _ => {}
            }
        }
        let is_along = 0.0 <= between[0] && between[0] < between[1] && between[1] <= 1.0;
        rules.extend(values.into_iter().filter(|_| is_along).map(|value| Rule { column, value, between }));
    }
    rules
}
