//! The built-in table: which tags make which kind, and what a kind is unless a rule says otherwise.

/// What a feature is. The order is that of the table: the first is the highest, and keeps its height where two meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Kind {
    /// Motorways, trunk roads and their links.
    Motorway,
    /// Primary to tertiary roads and their links.
    Primary,
    /// Unclassified, residential and service roads.
    Minor,
    /// Tracks.
    Track,
    /// Railways.
    Rail,
    /// Runways, taxiways and aprons.
    Runway,
    /// Rivers and canals: lines that fall, and polygons of their banks.
    River,
    /// Streams, ditches and drains.
    Stream,
    /// Level water.
    Lake,
    /// Dams and weirs: they split water and stay ground.
    Dam,
    /// Lines a job names, whose height is the feature's or the DEM's.
    Breakline,
}

impl Kind {
    /// All kinds, highest first.
    pub const ALL: [Kind; 11] = [
        Kind::Motorway,
        Kind::Primary,
        Kind::Minor,
        Kind::Track,
        Kind::Rail,
        Kind::Runway,
        Kind::River,
        Kind::Stream,
        Kind::Lake,
        Kind::Dam,
        Kind::Breakline,
    ];

    /// The word for it in a job, and the name of its class unless a rule gives one.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Motorway => "motorway",
            Kind::Primary => "primary",
            Kind::Minor => "minor",
            Kind::Track => "track",
            Kind::Rail => "rail",
            Kind::Runway => "runway",
            Kind::River => "river",
            Kind::Stream => "stream",
            Kind::Lake => "lake",
            Kind::Dam => "dam",
            Kind::Breakline => "breakline",
        }
    }

    /// The kind of that name.
    pub fn named(name: &str) -> Option<Kind> {
        Kind::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// Whether its height obeys a greatest grade.
    pub fn is_travelled(self) -> bool {
        matches!(self, Kind::Motorway | Kind::Primary | Kind::Minor | Kind::Track | Kind::Rail | Kind::Runway)
    }

    /// Whether it is a road or a railway: a line, whatever its shape.
    pub fn is_road(self) -> bool {
        self.is_travelled() && self != Kind::Runway
    }

    /// Whether its height falls.
    pub fn flows(self) -> bool {
        matches!(self, Kind::River | Kind::Stream)
    }

    /// Quanta of its width unless a tag or a rule says otherwise; 0 where it has none.
    pub fn width_default(self) -> i32 {
        128 * match self {
            Kind::Motorway => 12,
            Kind::Primary => 7,
            Kind::Minor | Kind::Rail => 5,
            Kind::Track => 3,
            Kind::Runway => 45,
            Kind::River => 10,
            Kind::Stream => 1,
            Kind::Lake | Kind::Dam | Kind::Breakline => 0,
        }
    }

    /// The greatest grade in parts per million; 0 where it has none.
    pub fn grade_default_ppm(self) -> u32 {
        10_000
            * match self {
                Kind::Motorway => 6,
                Kind::Primary => 10,
                Kind::Minor => 15,
                Kind::Track => 25,
                Kind::Rail => 3,
                Kind::Runway => 2,
                _ => 0,
            }
    }

    /// The form unless a rule says otherwise.
    pub fn form_default(self) -> Form {
        match self {
            Kind::Motorway | Kind::Primary | Kind::Minor | Kind::Rail | Kind::Runway => Form::Strip,
            Kind::Lake => Form::Polygon,
            _ => Form::Line,
        }
    }

    /// Whether lanes tell the width of a road of this kind.
    pub fn has_lanes(self) -> bool {
        matches!(self, Kind::Motorway | Kind::Primary | Kind::Minor)
    }
}

/// How a feature stands in the TIN.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Form {
    /// Its centreline.
    Line,
    /// Both edges, level across, where the ground falls across it; its centreline elsewhere.
    Strip,
    /// Both edges everywhere.
    StripAlways,
    /// Both edges, and the lines where its slopes meet the ground.
    Bench,
    /// The outline of a polygon.
    Polygon,
}

/// Values of one tag that make a kind.
type Match = (&'static str, &'static [&'static str], Kind);

const MATCHES: [Match; 14] = [
    ("highway", &["motorway", "trunk", "motorway_link", "trunk_link"], Kind::Motorway),
    (
        "highway",
        &["primary", "secondary", "tertiary", "primary_link", "secondary_link", "tertiary_link"],
        Kind::Primary,
    ),
    ("highway", &["unclassified", "residential", "service", "living_street"], Kind::Minor),
    ("highway", &["track"], Kind::Track),
    ("railway", &["rail", "light_rail"], Kind::Rail),
    ("aeroway", &["runway", "taxiway", "apron"], Kind::Runway),
    ("waterway", &["river", "canal", "riverbank"], Kind::River),
    ("waterway", &["stream", "ditch", "drain"], Kind::Stream),
    ("waterway", &["dam", "weir"], Kind::Dam),
    ("water", &["river"], Kind::River),
    ("water", &["lake"], Kind::Lake),
    ("natural", &["water"], Kind::Lake),
    ("landuse", &["reservoir"], Kind::Lake),
    ("kind", &["lake"], Kind::Lake),
];

/// The rows of the table as they are printed: tag, values, kind.
pub fn rows() -> impl Iterator<Item = (&'static str, &'static [&'static str], Kind)> {
    MATCHES.into_iter()
}

/// The kind of a feature with these tags by the built-in table: the first row that matches.
pub fn kind_of(tags: &[(String, String)]) -> Option<Kind> {
    row_of(tags).map(|row| MATCHES[row].2)
}

/// The number of the first row of the built-in table that matches these tags, from 0.
pub fn row_of(tags: &[(String, String)]) -> Option<usize> {
    let has = |key: &str, values: &[&str]| tags.iter().any(|(name, value)| name == key && values.contains(&&**value));
    MATCHES.iter().position(|(key, values, _)| has(key, values))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(tags: &[(&str, &str)], expected: Option<Kind>) {
        let tags: Vec<_> = tags.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
        assert_eq!(kind_of(&tags), expected);
    }

    #[test]
    fn tags_make_kinds_as_the_table_says() {
        check(&[("highway", "trunk_link")], Some(Kind::Motorway));
        check(&[("name", "B 173"), ("highway", "tertiary")], Some(Kind::Primary));
        check(&[("highway", "footway")], None);
        check(&[("highway", "path")], None);
        check(&[("railway", "light_rail")], Some(Kind::Rail));
        check(&[("aeroway", "apron")], Some(Kind::Runway));
        check(&[("natural", "water"), ("water", "river")], Some(Kind::River));
        check(&[("natural", "water"), ("water", "pond")], Some(Kind::Lake));
        check(&[("waterway", "riverbank")], Some(Kind::River));
        check(&[("landuse", "reservoir")], Some(Kind::Lake));
        check(&[("waterway", "weir")], Some(Kind::Dam));
    }

    #[test]
    fn every_kind_is_found_by_its_name_and_all_are_in_order() {
        assert!(Kind::ALL.is_sorted());
        assert!(Kind::ALL.iter().all(|kind| Kind::named(kind.name()) == Some(*kind)));
        assert_eq!(Kind::named("none"), None);
    }
}
