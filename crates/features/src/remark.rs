//! What was wrong with a feature and what was done about it: nothing is changed silently.

use std::fmt;

use crate::{FeatureId, Tolerance};

/// What was wrong.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Flaw {
    /// A tag whose value is not what it should be.
    BadTag {
        /// The tag.
        key: String,
        /// The value found.
        found: String,
    },
    /// `bridge` and `tunnel` on one way.
    BridgeAndTunnel,
    /// A rule gave a feature no kind, and the built-in table has none for it.
    NoKind,
    /// A coordinate that is not a number.
    NotFinite,
    /// A position so far away that no map has it.
    OffTheEarth,
    /// A vertex far from both of its neighbours.
    Displaced,
    /// Nothing of it lies in the area.
    Outside,
    /// The same position twice in a row.
    RepeatedPoint,
    /// A line that goes out and back.
    Spike,
    /// Fewer than two places.
    ZeroLength,
    /// A ring without area.
    ZeroArea,
    /// The same as another, or its reverse.
    Doubled,
    /// Part of it is part of another.
    DoubledInPart,
    /// An end that misses another way by less than a metre, or ends on its carriageway.
    Gap,
    /// A line that crosses itself.
    SelfCrossing,
    /// Two ways of one storey that cross without a shared vertex.
    CrossingUnjoined,
    /// A ring that crosses itself.
    BowTie,
    /// A ring whose ends do not meet.
    UnclosedRing,
    /// A hole outside every outer ring.
    HoleOutside,
    /// A line where a polygon is needed, or the other way round.
    WrongShape,
    /// More stations in a load module than can be worked on.
    Crowded,
    /// Two pins on one place that disagree.
    PinsDisagree,
    /// Pins that contradict the greatest grade between them; the grade there in thousandths of a percent.
    PinsTooSteep {
        /// The grade found, in parts per million.
        grade_ppm: u32,
    },
    /// A way steeper than its grade, because limits of cut and fill ask for it.
    GradeRelaxed {
        /// The steepest grade found, in parts per million.
        grade_ppm: u32,
        /// Whole metres of it that are steeper than its grade.
        metres: u32,
    },
    /// A deck too low over what it crosses; how much is missing.
    ClearanceLacks {
        /// Quanta of 1/128 m that are missing.
        quanta: i32,
    },
    /// A bridge whose deck would run through ground.
    GroundAboveDeck {
        /// How far the ground stands above it, in quanta.
        quanta: i32,
        /// Whole metres of it that do.
        metres: u32,
    },
    /// A road over a river without a bridge.
    RoadOverRiver,
    /// A river digitised uphill.
    FlowsUphill,
    /// Water that flows in a circle.
    FlowsInCircle,
    /// A river polygon without a line inside, on a sloping shore.
    NoLineInside,
    /// A level that does not fit the shore.
    LevelRefused {
        /// The level of the source, in quanta.
        found: i32,
    },
    /// A lake without a flat inside, whose shore and inside differ by so much.
    LevelUncertain {
        /// Quanta between the lower and the upper tenth of its heights.
        quanta: i32,
    },
    /// Rivers that ask for another level of a lake than its own heights do.
    RiversMoveLevel {
        /// Quanta by which they raise it.
        quanta: i32,
    },
    /// A bank well below its water.
    BankBelowWater {
        /// Quanta between them.
        quanta: i32,
    },
    /// A cut or a fill beyond its limit.
    BeyondLimit {
        /// Quanta of the highest fill, or of the deepest cut, less than 0.
        quanta: i32,
        /// Whole metres of it that are beyond the limit.
        metres: u32,
    },
    /// Shore below the water.
    ShoreBelowWater {
        /// What was filled, in whole cubic metres.
        cubic_metres: i64,
    },
    /// Level water that meets water of another level.
    LevelsDisagree,
    /// Two features of different class in one place.
    Overlap,
    /// A strip narrower than four steps of the lattice.
    TooNarrow,
    /// More triangles than features may take of a limit.
    OverShare,
    /// An end where its source goes on, soon after a junction or inside one load module.
    Stub,
    /// A part of the road network that hangs together with too little.
    Alone,
    /// A small body of water with a long shore.
    Pond,
}

impl fmt::Display for Flaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let metres = |quanta: i32| terrain::metres_of_quanta(quanta);
        match self {
            Flaw::BadTag { key, found } => write!(f, "{key} = \"{found}\" is not a value it can have"),
            Flaw::PinsTooSteep { grade_ppm } => {
                write!(f, "pinned heights ask for a grade of {:.1} %", f64::from(*grade_ppm) / 1e4)
            }
            Flaw::GradeRelaxed { grade_ppm, metres } => {
                write!(f, "the ground asks for a grade of {:.1} %, over {metres} m", f64::from(*grade_ppm) / 1e4)
            }
            Flaw::ClearanceLacks { quanta } => write!(f, "the deck is {:.2} m too low", metres(*quanta)),
            Flaw::LevelUncertain { quanta } => {
                write!(f, "heights along and inside it differ by {:.1} m", metres(*quanta))
            }
            Flaw::RiversMoveLevel { quanta } => {
                write!(f, "its rivers ask for a level {:.2} m off its own", metres(*quanta))
            }
            Flaw::BankBelowWater { quanta } => write!(f, "a bank lies {:.1} m below its water", metres(*quanta)),
            Flaw::BeyondLimit { quanta, metres: length } => {
                let what = if *quanta < 0 { "cuts" } else { "is filled" };
                write!(f, "it {what} by {:.1} m, and beyond the limit over {length} m", metres(quanta.abs()))
            }
            Flaw::GroundAboveDeck { quanta, metres: length } => {
                write!(f, "ground stands {:.1} m above the deck, over {length} m", metres(*quanta))
            }
            Flaw::LevelRefused { found } => write!(f, "its level of {:.2} m does not fit its shore", metres(*found)),
            Flaw::ShoreBelowWater { cubic_metres } => {
                write!(f, "shore lies below the water, {cubic_metres} m3 of fill")
            }
            other => f.write_str(other.sentence()),
        }
    }
}

impl Flaw {
    fn sentence(&self) -> &'static str {
        match self {
            Flaw::BridgeAndTunnel => "it is a bridge and a tunnel",
            Flaw::NoKind => "no kind is known for it",
            Flaw::NotFinite => "a coordinate is not a number",
            Flaw::OffTheEarth => "a position is off the earth",
            Flaw::Displaced => "a vertex lies far from both of its neighbours",
            Flaw::Outside => "it lies outside the area",
            Flaw::RepeatedPoint => "a point is repeated",
            Flaw::Spike => "it goes out and back",
            Flaw::ZeroLength => "it has no length",
            Flaw::ZeroArea => "a ring has no area",
            Flaw::Doubled => "it is a copy of another",
            Flaw::DoubledInPart => "part of it is a copy of another",
            Flaw::Gap => "an end misses another way and lies on it, or less than a metre off",
            Flaw::SelfCrossing => "it crosses itself",
            Flaw::CrossingUnjoined => "it crosses another way without a shared vertex",
            Flaw::BowTie => "a ring crosses itself",
            Flaw::UnclosedRing => "a ring is not closed",
            Flaw::HoleOutside => "a hole lies outside every outer ring",
            Flaw::WrongShape => "its shape does not suit its kind",
            Flaw::Crowded => "its load module holds more than can be worked on",
            Flaw::PinsDisagree => "two pinned heights disagree at one place",
            Flaw::RoadOverRiver => "a road crosses a river without a bridge",
            Flaw::FlowsUphill => "it is drawn uphill",
            Flaw::FlowsInCircle => "its water flows in a circle",
            Flaw::NoLineInside => "no line runs inside it and its shore is not level",
            Flaw::LevelsDisagree => "it meets water of another level",
            Flaw::Overlap => "it overlaps a higher class",
            Flaw::TooNarrow => "it is narrower than four lattice steps",
            Flaw::OverShare => "features take more than their share of a limit",
            Flaw::Stub => "only an end of it has room, which leads nowhere",
            Flaw::Alone => "only a piece of its network has room, which hangs together with nothing",
            Flaw::Pond => "its shore is long for so little water",
            _ => "it has a flaw",
        }
    }
}

/// What was done about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Remedy {
    /// The whole feature was left out.
    LeftOut,
    /// The part named was left out.
    PartLeftOut,
    /// The point was left out.
    PointLeftOut,
    /// The default was taken.
    DefaultTaken,
    /// The bridge was kept.
    BridgeKept,
    /// The ends were joined.
    Joined,
    /// A shared vertex was put in.
    VertexShared,
    /// The ring was split into simple ones.
    Split,
    /// The ring was closed by a straight line.
    Closed,
    /// It became an outline without an inside.
    OutlineOnly,
    /// One height was kept.
    OneKept,
    /// The grade is exceeded.
    GradeExceeded,
    /// It was left as it is.
    LeftAsItIs,
    /// A culvert: the road stays and the channel passes.
    Culvert,
    /// A tunnel: the way leads through, and nothing of it is in the ground.
    Tunnel,
    /// It was turned round.
    TurnedRound,
    /// It lies level.
    Levelled,
    /// It became a lake.
    BecameLake,
    /// The level of the shore was taken.
    ShoreTaken,
    /// The level was moved to that of its rivers.
    RiversFollowed,
    /// The limit is exceeded.
    LimitExceeded,
    /// The ground was lifted.
    Lifted,
    /// It was made narrower.
    Narrowed,
    /// It became a strip.
    BecameStrip,
    /// It became a line.
    BecameLine,
    /// It was cut.
    Cut,
    /// Tolerances were made larger.
    Coarser {
        /// How many times.
        times: u8,
    },
}

impl fmt::Display for Remedy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Remedy::Coarser { times } => {
                let aside_m = Tolerance::USUAL.aside_m * f64::from(*times);
                return write!(f, "thinned with {times} times the tolerance, up to {aside_m:.0} m aside");
            }
            Remedy::LeftOut => "left out",
            Remedy::PartLeftOut => "left out in part",
            Remedy::PointLeftOut => "the point was left out",
            Remedy::DefaultTaken => "the default was taken",
            Remedy::BridgeKept => "taken as a bridge",
            Remedy::Joined => "joined",
            Remedy::VertexShared => "a shared vertex was put in",
            Remedy::Split => "split into simple rings",
            Remedy::Closed => "closed by a straight line",
            Remedy::OutlineOnly => "its outline only was kept",
            Remedy::OneKept => "one of them was kept",
            Remedy::GradeExceeded => "the greatest grade is exceeded there",
            Remedy::LeftAsItIs => "left as it is",
            Remedy::Culvert => "a culvert was assumed",
            Remedy::Tunnel => "a tunnel was assumed",
            Remedy::TurnedRound => "turned round",
            Remedy::Levelled => "laid level",
            Remedy::BecameLake => "taken as a lake",
            Remedy::ShoreTaken => "the level of its shore was taken",
            Remedy::RiversFollowed => "they were followed",
            Remedy::LimitExceeded => "the limit is exceeded there",
            Remedy::Lifted => "the ground was lifted",
            Remedy::Narrowed => "made narrower",
            Remedy::BecameStrip => "became a strip without slopes",
            Remedy::BecameLine => "became a line",
            Remedy::Cut => "cut",
        })
    }
}

impl Remedy {
    /// Whether the feature, or part of it, is missing from the ground because of it.
    pub fn leaves_out(self) -> bool {
        matches!(self, Remedy::LeftOut | Remedy::PartLeftOut | Remedy::Cut)
    }

    /// Whether the feature falls short of what was asked for because of it.
    pub fn degrades(self) -> bool {
        matches!(
            self,
            Remedy::Narrowed
                | Remedy::BecameStrip
                | Remedy::BecameLine
                | Remedy::Coarser { .. }
                | Remedy::OutlineOnly
                | Remedy::LeftAsItIs
                | Remedy::Tunnel
        )
    }
}

/// One thing that was mended, degraded or left out.
#[derive(Clone, Debug, PartialEq)]
pub struct Remark {
    /// The feature.
    pub id: FeatureId,
    /// Posts east and north; `None` where the feature has no position.
    pub posts: Option<[f64; 2]>,
    /// What was wrong.
    pub flaw: Flaw,
    /// What was done.
    pub remedy: Remedy,
}

impl Remark {
    /// Sorts remarks by feature, flaw and place, so that they do not depend on the order of work; equal ones once.
    pub fn sort(remarks: &mut Vec<Remark>) {
        let key = |remark: &Remark| remark.posts.unwrap_or([f64::NEG_INFINITY; 2]);
        remarks.sort_by(|a, b| {
            let place = key(a)[1].total_cmp(&key(b)[1]).then(key(a)[0].total_cmp(&key(b)[0]));
            (a.id, &a.flaw, a.remedy).cmp(&(b.id, &b.flaw, b.remedy)).then(place)
        });
        remarks.dedup();
    }
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}; {}", self.id, self.flaw, self.remedy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Numbering;

    #[test]
    fn a_remark_reads_as_a_sentence() {
        let id = FeatureId { source: 0, numbering: Numbering::Way, number: 12 };
        let flaw = Flaw::BadTag { key: "width".into(), found: "wide".into() };
        let remark = Remark { id, posts: None, flaw, remedy: Remedy::DefaultTaken };
        assert_eq!(remark.to_string(), "way 12: width = \"wide\" is not a value it can have; the default was taken");
    }
}
