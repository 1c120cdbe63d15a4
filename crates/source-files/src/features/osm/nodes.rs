//! Places of nodes: those near the area in a sorted table of sixteen bytes each, and those that kept ways need besides.

use super::block::{Decimicro, OFF_THE_EARTH};
use crate::SourceError;
use crate::features::clip::Extent;
use crate::limits::Allowance;

/// Bytes that a node takes in a table, and while that grows.
const NODE_BYTES: usize = 32;

/// Where nodes lie.
#[derive(Debug)]
pub(super) struct Nodes {
    /// What counts as near, in degrees.
    box_near: Extent,
    near: Table,
    /// Nodes farther away that are needed all the same.
    far: Table,
    /// Where all nodes of the file lie, those that are not on the Earth left out.
    pub lies: Extent,
}

impl Nodes {
    pub(super) fn new(box_near: Extent) -> Self {
        Self { box_near, near: Table::default(), far: Table::default(), lies: Extent::NOTHING }
    }

    /// Takes note of a node. One that is not on the Earth counts as near, so that it is told.
    pub(super) fn see(&mut self, id: i64, place: Decimicro, allowance: &Allowance) -> Result<(), SourceError> {
        let is_off = place == OFF_THE_EARTH;
        let degrees = degrees(place);
        if !is_off {
            self.lies.hold(degrees);
        }
        if is_off || self.box_near.holds(degrees) {
            allowance.take(NODE_BYTES)?;
            self.near.all.push((id, place));
        }
        Ok(())
    }

    /// To be called when all have been seen.
    pub(super) fn sort(&mut self) {
        self.near.sort();
        self.far.sort();
    }

    pub(super) fn is_near(&self, id: i64) -> bool {
        self.near.find(id).is_some()
    }

    /// Where a node lies that is near or was needed.
    pub(super) fn place(&self, id: i64) -> Option<Decimicro> {
        self.near.find(id).or_else(|| self.far.find(id))
    }

    /// Keeps a node that is needed.
    pub(super) fn keep(&mut self, id: i64, place: Decimicro, allowance: &Allowance) -> Result<(), SourceError> {
        allowance.take(NODE_BYTES)?;
        self.far.all.push((id, place));
        Ok(())
    }
}

/// Ids and places in the order of ids. Every 64th id stands in a list of its own, which is small enough for a
/// processor's cache, so that a search goes to memory once.
#[derive(Debug, Default)]
struct Table {
    all: Vec<(i64, Decimicro)>,
    heads: Vec<i64>,
}

const RUN: usize = 64;

impl Table {
    fn sort(&mut self) {
        if !self.all.is_sorted_by(|a, b| a.0 < b.0) {
            // A node that a file has twice lies where its lesser place is, in whatever order they come.
            self.all.sort_unstable();
            self.all.dedup_by_key(|(id, _)| *id);
        }
        self.all.shrink_to_fit();
        self.heads = self.all.iter().step_by(RUN).map(|(id, _)| *id).collect();
    }

    fn find(&self, id: i64) -> Option<Decimicro> {
        let begin = self.heads.partition_point(|&head| head <= id).checked_sub(1)? * RUN;
        let run = &self.all[begin..self.all.len().min(begin + RUN)];
        run.binary_search_by_key(&id, |(id, _)| *id).ok().map(|index| run[index].1)
    }
}

pub(super) fn degrees(place: Decimicro) -> [f64; 2] {
    place.map(|number| f64::from(number) / 1.0e7)
}
