//! Buildings of OpenStreetMap data, read in the same passes as features and apart from them: what is kept, counted and
//! told of features is the same with and without.

use terrain::Each;

use super::assemble::Role;
use super::block::{Block, MemberKind, Relation, Way};
use super::kept::{KeptRelation, KeptWay, KnownTexts, sort_ways, wanted_texts};
use super::nodes::{Nodes, degrees};
use super::shapes;
use crate::SourceError;
use crate::features::clip::Extent;
use crate::features::columns::Texts;
use crate::features::model::{BUILDING_KEY, Tags, VectorFeature};
use crate::features::placing::Placing;
use crate::limits::Allowance;

/// Keys that say how high a building is. No others are kept: most buildings have an address.
const KEYS: [&str; 5] = [BUILDING_KEY, "height", "building:levels", "min_height", "building:min_level"];

/// What is kept of buildings while a file is gone through.
pub(super) struct Buildings {
    /// Where buildings count, in degrees.
    near: Extent,
    ways: Vec<KeptWay>,
    relations: Vec<KeptRelation>,
    /// Ways of relations, sorted, and whether the way is outside.
    members: Vec<(i64, bool)>,
}

/// Which texts of a block are among [`KEYS`], the first of them apart.
pub(super) struct BuildingTexts {
    is_building: Vec<bool>,
    is_kept: Vec<bool>,
}

impl BuildingTexts {
    pub(super) fn of(block: &Block) -> Self {
        Self { is_building: wanted_texts(block, &KEYS[..1]), is_kept: wanted_texts(block, &KEYS) }
    }

    fn has(&self, tags: &[(usize, usize)]) -> bool {
        tags.iter().any(|&(key, _)| self.is_building[key])
    }

    fn tags(&self, block: &Block, tags: &[(usize, usize)], known: &mut KnownTexts, texts: &mut Texts) -> Tags {
        let kept: Vec<(usize, usize)> = tags.iter().copied().filter(|&(key, _)| self.is_kept[key]).collect();
        known.tags(block, &kept, texts)
    }
}

impl Buildings {
    /// Of a file whose buildings count within `near`, in degrees.
    pub(super) fn new(near: Extent) -> Self {
        Self { near, ways: Vec::new(), relations: Vec::new(), members: Vec::new() }
    }

    /// Takes note of a multipolygon relation.
    pub(super) fn see_relation(
        &mut self,
        block: &Block,
        relation: &Relation,
        of: &BuildingTexts,
        (known, texts): (&mut KnownTexts, &mut Texts),
        allowance: &Allowance,
    ) -> Result<(), SourceError> {
        if !of.has(&relation.tags) {
            return Ok(());
        }
        let role = |text: usize| if block.texts[text] == b"inner" { Role::Inner } else { Role::Outer };
        let ways = relation.members.iter().filter(|(kind, ..)| *kind == MemberKind::Way);
        let members: Vec<(Role, i64)> = ways.map(|&(_, id, text)| (role(text), id)).collect();
        self.members.extend(members.iter().map(|&(role, id)| (id, role == Role::Outer)));
        let tags = of.tags(block, &relation.tags, known, texts);
        texts.count(allowance);
        self.relations.push(KeptRelation { id: relation.id, tags, members }.counted(allowance)?);
        Ok(())
    }

    /// To be called when all relations have been seen.
    pub(super) fn sort_relations(&mut self) {
        self.relations.sort_by_key(|relation| relation.id);
        self.relations.dedup_by_key(|relation| relation.id);
        self.members.sort_unstable();
    }

    /// Takes note of a way.
    pub(super) fn see_way(
        &mut self,
        block: &Block,
        way: &Way,
        of: &BuildingTexts,
        (known, texts): (&mut KnownTexts, &mut Texts),
        nodes: &Nodes,
        allowance: &Allowance,
    ) -> Result<(), SourceError> {
        let member = self.members.partition_point(|&(id, _)| id < way.id);
        let of_relations = self.members[member..].iter().take_while(|(id, _)| *id == way.id);
        // The outline of a relation is read with that.
        let is_outline = of_relations.clone().any(|(_, is_outer)| *is_outer);
        let is_wanted = !is_outline && of.has(&way.tags);
        if !is_wanted && of_relations.count() == 0 {
            return Ok(());
        }
        if way.nodes.iter().any(|&node| nodes.place(node).is_some_and(|place| self.near.holds(degrees(place)))) {
            let tags = if is_wanted { of.tags(block, &way.tags, known, texts) } else { Tags::new() };
            let nodes = way.nodes.as_slice().into();
            texts.count(allowance);
            self.ways.push(KeptWay { id: way.id, tags, nodes, reaches_out: false, is_wanted }.counted(allowance)?);
        }
        Ok(())
    }

    /// The buildings: relations, then ways, by number. What is wrong with single ones is not told: they are drawn only.
    pub(super) fn placed(mut self, nodes: &Nodes, placing: &Placing, each: Each) -> Vec<VectorFeature> {
        sort_ways(&mut self.ways);
        let ways = &self.ways;
        let is_kept = |id: i64| ways.binary_search_by_key(&id, |way| way.id).is_ok();
        self.relations.retain(|relation| relation.members.iter().any(|&(_, id)| is_kept(id)));
        let mut apart = placing.of_part();
        shapes::place(nodes, self.ways, self.relations, &mut apart, |_| true, each);
        apart.into_features()
    }
}
