//! What an object is by its tags, and how high.

use terrain::ObjectKind;

use super::plan::METRE;
use crate::lengths::{decimal, height_of, metres_of, width_of};

/// Metres of a storey, and of a roof above the last.
const LEVEL_M: f64 = 3.0;
/// See [`LEVEL_M`].
const ROOF_M: f64 = 2.0;
/// What is higher is a slip of the pen: the highest building has 828 m.
const HEIGHT_M_MAX: f64 = 1000.0;
/// The highest trees have 116 m, and the file holds heights of canopies up to 511 m.
const TREE_M_MAX: f64 = 130.0;

/// Heights in metres of buildings whose tags say none, by the value of `building`; of all others [`BUILDING_M`].
const BUILDINGS: [(&str, f64); 22] = [
    ("apartments", 12.0),
    ("barn", 7.0),
    ("cabin", 4.0),
    ("carport", 3.0),
    ("cathedral", 30.0),
    ("chapel", 8.0),
    ("church", 15.0),
    ("farm_auxiliary", 5.0),
    ("garage", 3.0),
    ("garages", 3.0),
    ("greenhouse", 4.0),
    ("hangar", 10.0),
    ("hospital", 14.0),
    ("hotel", 12.0),
    ("hut", 3.0),
    ("industrial", 9.0),
    ("office", 14.0),
    ("roof", 4.0),
    ("shed", 3.0),
    ("silo", 18.0),
    ("stadium", 20.0),
    ("warehouse", 9.0),
];
const BUILDING_M: f64 = 6.0;
/// Heights by the value of `man_made`, and widths of what is a point; no other value is a tower.
const TOWERS: [(&str, f64, f64); 9] = [
    ("chimney", 40.0, 4.0),
    ("communications_tower", 80.0, 8.0),
    ("cooling_tower", 80.0, 50.0),
    ("gasometer", 20.0, 30.0),
    ("mast", 30.0, 1.0),
    ("silo", 18.0, 6.0),
    ("storage_tank", 10.0, 12.0),
    ("tower", 30.0, 6.0),
    ("water_tower", 30.0, 8.0),
];
/// The same of what carries the wires of a power line: it is open, so it hides as little as a thin mast.
const PYLON_M: [f64; 2] = [30.0, 1.0];
/// Height and crown of a tree that stands alone.
const TREE_M: [f64; 2] = [10.0, 6.0];

/// What an object is, in quanta where a name does not say otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Traits {
    /// What it is.
    pub kind: ObjectKind,
    /// Whether it is a part of a building, which stands in the place of that.
    pub is_part: bool,
    /// From the highest ground under it to where it begins: 0 but for what hangs above it.
    pub bottom: i32,
    /// From the highest ground under it to its roof, or from the ground to the top of a canopy.
    pub height: i32,
    /// Of a line, or a point.
    pub width: i32,
    /// Per cent of the light that 10 m of a canopy take away; 100 of what is none.
    pub fullness: u8,
}

/// Keys of OpenStreetMap by which the table tells what an object is.
pub const OBJECT_KEYS: [&str; 7] = ["building", "building:part", "landuse", "natural", "barrier", "man_made", "power"];

/// What a job says of objects with certain tags.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectRule {
    /// Tags that an object must have: of each key one of some values, or any.
    pub tags: Vec<(String, Vec<String>)>,
    /// What it is; `None` as its tags say.
    pub kind: Option<Option<ObjectKind>>,
    /// How high it is.
    pub height_m: Option<f64>,
}

impl ObjectRule {
    fn takes<'a>(&self, tag: &impl Fn(&str) -> Option<&'a str>) -> bool {
        let has = |(key, values): &(String, Vec<String>)| {
            tag(key).is_some_and(|found| values.is_empty() || values.iter().any(|value| value == found))
        };
        self.tags.iter().all(has)
    }
}

/// What an object with these tags is: by the first rule that takes it, then as `source` says, then by the table; `None`
/// where it is none. With it the tags that say a height which cannot be.
pub fn traits<'a>(
    tag: impl Fn(&str) -> Option<&'a str>,
    source: (Option<ObjectKind>, Option<&str>),
    rules: &[ObjectRule],
) -> Option<(Traits, Vec<(String, String)>)> {
    let rule = rules.iter().find(|rule| rule.takes(&tag));
    let said = rule.and_then(|rule| rule.kind);
    let (kind, [usual_m, usual_width_m]) = kind_of(&tag);
    let kind = match said {
        Some(kind) => kind?,
        None if lies_underground(&tag) => return None,
        None => source.0.or(kind)?,
    };
    let mut bad = Vec::new();
    let usual_m = usual_m.unwrap_or_else(|| usual_m_of(kind));
    let most_m = if kind.is_prism() { HEIGHT_M_MAX } else { TREE_M_MAX };
    let mut metres = |key: &str, of: fn(&str) -> Option<f64>, times: f64| {
        let text = tag(key)?;
        let found = of(text).map(|number| number * times).filter(|metres| (0.0..=most_m).contains(metres));
        if found.is_none() {
            bad.push((key.to_owned(), text.to_owned()));
        }
        found
    };
    let levels: fn(&str) -> Option<f64> = |text| decimal(text.trim());
    let top_m = metres(source.1.unwrap_or("height"), metres_of, 1.0);
    let top_m = top_m.or_else(|| {
        let storeys_m = metres("building:levels", levels, LEVEL_M).filter(|storeys_m| 0.0 < *storeys_m)?;
        kind.is_prism().then_some(storeys_m + ROOF_M)
    });
    let bottom_m = metres("min_height", height_of, 1.0).or_else(|| metres("building:min_level", levels, LEVEL_M));
    let width_m = metres("width", width_of, 1.0);
    let said_m = rule.and_then(|rule| rule.height_m);
    let bottom_m = bottom_m.filter(|_| kind == ObjectKind::Building).unwrap_or(0.0);
    let height_m = said_m.or(top_m).unwrap_or(bottom_m + usual_m);
    let bottom_m = if bottom_m < height_m { bottom_m } else { 0.0 };
    let quanta = |metres: f64| (metres * METRE).round() as i32;
    let traits = Traits {
        kind,
        is_part: tag("building:part").is_some_and(is_yes),
        bottom: quanta(bottom_m),
        height: quanta(height_m).max(1),
        width: quanta(width_m.or(usual_width_m).unwrap_or_else(|| width_m_of(kind, height_m))),
        fullness: fullness_of(kind, height_m),
    };
    Some((traits, bad))
}

/// Whether nothing of it stands above the ground: a car park under a square, a station.
fn lies_underground<'a>(tag: impl Fn(&str) -> Option<&'a str>) -> bool {
    let is_building = ["building", "building:part"].into_iter().filter_map(&tag).any(is_yes);
    let is_below = |layer: &str| layer.trim().strip_prefix('-').and_then(decimal).is_some_and(|layer| 0.0 < layer);
    let is_said = tag("location") == Some("underground") || tag("is_underground") == Some("true");
    is_building && (is_said || tag("layer").is_some_and(is_below))
}

fn is_yes(value: &str) -> bool {
    !matches!(value.trim(), "" | "no")
}

/// The kind that the table gives, and the usual height and width where they depend on more than the kind.
fn kind_of<'a>(tag: &impl Fn(&str) -> Option<&'a str>) -> (Option<ObjectKind>, [Option<f64>; 2]) {
    if let Some(value) = tag("building:part").or_else(|| tag("building")).filter(|value| is_yes(value)) {
        let usual_m = BUILDINGS.iter().find(|(name, _)| *name == value).map(|(_, usual_m)| *usual_m);
        return (Some(ObjectKind::Building), [usual_m, None]);
    }
    let tower = tag("man_made").and_then(|value| TOWERS.iter().find(|(name, ..)| *name == value));
    if let Some((_, height_m, width_m)) = tower {
        return (Some(ObjectKind::Tower), [*height_m, *width_m].map(Some));
    }
    let (kind, height_m) = match (tag("landuse"), tag("natural"), tag("barrier"), tag("power")) {
        (Some("forest"), ..) | (_, Some("wood"), ..) => (ObjectKind::Wood, None),
        (_, Some("scrub"), ..) => (ObjectKind::Scrub, None),
        (Some("orchard"), ..) => (ObjectKind::Orchard, None),
        (Some("vineyard"), ..) => (ObjectKind::Orchard, Some(2.0)),
        (_, Some("tree_row"), ..) => (ObjectKind::Row, Some(12.0)),
        (_, Some("tree"), ..) => return (Some(ObjectKind::Row), TREE_M.map(Some)),
        (.., Some("hedge"), _) => (ObjectKind::Row, None),
        (.., Some("wall"), _) => (ObjectKind::Wall, None),
        (.., Some("city_wall"), _) => (ObjectKind::Wall, Some(8.0)),
        (.., Some("tower")) => return (Some(ObjectKind::Tower), PYLON_M.map(Some)),
        _ => return (None, [None; 2]),
    };
    (Some(kind), [height_m, None])
}

fn usual_m_of(kind: ObjectKind) -> f64 {
    match kind {
        ObjectKind::Building => BUILDING_M,
        ObjectKind::Tower => 30.0,
        ObjectKind::Wall | ObjectKind::Row => 2.0,
        ObjectKind::Wood => 15.0,
        ObjectKind::Scrub => 3.0,
        ObjectKind::Orchard => 4.0,
    }
}

/// What is lower is a hedge, what is higher a row of trees.
const HEDGE_M_MAX: f64 = 6.0;

fn width_m_of(kind: ObjectKind, height_m: f64) -> f64 {
    match kind {
        ObjectKind::Row if HEDGE_M_MAX < height_m => 6.0,
        ObjectKind::Row => 2.0,
        ObjectKind::Tower => 6.0,
        _ => 0.5,
    }
}

fn fullness_of(kind: ObjectKind, height_m: f64) -> u8 {
    match kind {
        ObjectKind::Building | ObjectKind::Tower | ObjectKind::Wall => 100,
        // A hedge of 2 m has to hide, and 10 m of leaves are what fullness is of.
        ObjectKind::Row if height_m <= HEDGE_M_MAX => 99,
        ObjectKind::Wood | ObjectKind::Row => 90,
        ObjectKind::Scrub | ObjectKind::Orchard => 50,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(tags: &[(&str, &'static str)], expected: Option<(ObjectKind, f64, f64, usize)>) {
        let tag = |key: &str| tags.iter().find(|(name, _)| *name == key).map(|(_, value)| *value);
        let found = traits(tag, (None, None), &[]).map(|(traits, bad)| {
            (traits.kind, f64::from(traits.bottom) / METRE, f64::from(traits.height) / METRE, bad.len())
        });
        assert_eq!(found, expected, "{tags:?}");
    }

    #[test]
    fn kinds_and_heights_are_those_of_the_tags() {
        use ObjectKind::{Building, Orchard, Row, Tower, Wall, Wood};
        const YES: (&str, &str) = ("building", "yes");
        check(&[("highway", "track")], None);
        check(&[("building", "no"), ("height", "9")], None);
        check(&[YES], Some((Building, 0.0, 6.0, 0)));
        check(&[("building", "church")], Some((Building, 0.0, 15.0, 0)));
        check(&[YES, ("height", "12.5 m"), ("building:levels", "2")], Some((Building, 0.0, 12.5, 0)));
        check(&[YES, ("building:levels", "4")], Some((Building, 0.0, 14.0, 0)));
        check(&[YES, ("height", "20"), ("min_height", "8")], Some((Building, 8.0, 20.0, 0)));
        for below in [("layer", "-2"), ("location", "underground"), ("is_underground", "true")] {
            check(&[YES, ("height", "20"), below], None);
        }
        check(&[YES, ("layer", "1")], Some((Building, 0.0, 6.0, 0)));
        check(&[("building:part", "roof"), ("building:min_level", "2")], Some((Building, 6.0, 10.0, 0)));
        check(&[("man_made", "chimney"), ("height", "100")], Some((Tower, 0.0, 100.0, 0)));
        check(&[("man_made", "bridge")], None);
        check(&[("natural", "wood"), ("height", "20")], Some((Wood, 0.0, 20.0, 0)));
        check(&[("landuse", "vineyard")], Some((Orchard, 0.0, 2.0, 0)));
        check(&[("natural", "tree_row")], Some((Row, 0.0, 12.0, 0)));
        check(&[("barrier", "fence")], None);
        check(&[("barrier", "city_wall")], Some((Wall, 0.0, 8.0, 0)));
        check(&[("natural", "tree")], Some((Row, 0.0, 10.0, 0)));
        check(&[("power", "tower"), ("height", "52")], Some((Tower, 0.0, 52.0, 0)));
        check(&[("power", "line")], None);
    }

    #[test]
    fn a_height_that_cannot_be_is_told_and_passed_over() {
        use ObjectKind::{Building, Wood};
        const HOUSE: (&str, &str) = ("building", "house");
        for wrong in ["high", "3 storeys", "-5", "1e9", "20000", "nan", ""] {
            check(&[HOUSE, ("height", wrong), ("building:levels", "3")], Some((Building, 0.0, 11.0, 1)));
            check(&[HOUSE, ("height", wrong), ("building:levels", wrong)], Some((Building, 0.0, 6.0, 2)));
        }
        check(&[HOUSE, ("height", "10"), ("min_height", "12")], Some((Building, 0.0, 10.0, 0)));
        check(&[("natural", "wood"), ("height", "400")], Some((Wood, 0.0, 15.0, 1)));
    }

    #[test]
    fn rules_come_first_then_what_the_source_says() {
        let tags = [("building", "ruins"), ("h", "7")];
        let tag = |key: &str| tags.iter().find(|(name, _)| *name == key).map(|(_, value)| *value);
        let rule =
            |kind, height_m| ObjectRule { tags: vec![("building".into(), vec!["ruins".into()])], kind, height_m };
        assert_eq!(traits(tag, (None, None), &[rule(Some(None), None)]), None);
        let height = |rules: &[ObjectRule], source| traits(tag, source, rules).unwrap().0.height / 128;
        assert_eq!(height(&[rule(None, Some(2.0))], (None, None)), 2);
        assert_eq!(height(&[], (None, Some("h"))), 7);
        let wood = traits(tag, (Some(ObjectKind::Wood), None), &[]).unwrap().0;
        assert_eq!((wood.kind, wood.fullness), (ObjectKind::Wood, 90));
    }
}
