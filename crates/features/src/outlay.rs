//! What each stretch would put into the ground at every tolerance: an estimate from thinned stations alone, before
//! anything is rounded together.
//!
//! Strokes are thinned as wholes, so that a junction at which nothing else is granted costs nothing on a straight road.

use std::collections::{BTreeSet, HashMap};

use crate::forms::{shared_places, stations};
use crate::pieces::is_narrow;
use crate::shares::Shares;
use crate::strand::{Graded, Strand, Way};
use crate::stretches::{Part, Stretches};
use crate::strokes::Stroke;
use crate::thin::{Station, Tolerance, thin};
use crate::{Form, Grants, Place, Site, Traits};

/// The end of a segment between two stations that stay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct End {
    /// Its place, in [`Outlays::points`].
    pub point: u32,
    /// The form from which on the segment is a strip, if there is one.
    pub strip_from: Option<u8>,
    /// Whether it has slopes where it may.
    pub bench: bool,
    /// Whether the stroke needs no station here where nothing but it passes.
    pub free: bool,
}

/// What a stretch puts into the ground at one tolerance.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Outlay {
    /// Both ends of each of its segments.
    pub ends: Vec<End>,
    /// Triangles of its decks, by number of the load module.
    pub decks: Vec<(u32, u32)>,
}

/// What all stretches put into the ground.
#[derive(Clone, Debug, Default)]
pub(crate) struct Outlays {
    /// By stretch and tolerance; none where it may not be so coarse.
    pub all: Vec<[Outlay; Tolerance::ALL.len()]>,
    /// The load modules that each point adds triangles to, and how many.
    pub points: Vec<[Option<(u32, u8)>; 2]>,
}

impl Outlays {
    /// Those of stretches that hang together in strokes.
    pub fn of(
        stretches: &Stretches,
        strokes: &[Stroke],
        (graded, onto_decks): (&Graded, &BTreeSet<u32>),
        strands: &[Strand],
        (shares, site): (&Shares, &Site),
    ) -> Self {
        let shared = shared_places(graded.network, strands, &Grants::default());
        let stays = |place: Place| shared.contains(&place);
        let all = vec![Default::default(); stretches.all.len()];
        let outlays = Self { all, points: Vec::new() };
        let numbers = HashMap::new();
        let mut counting = Counting { outlays, numbers, graded, onto_decks, stays: &stays, shares, site };
        for stroke in strokes {
            let coarsest = stretches.all[stroke.stretches[0].0 as usize].coarsest();
            for tolerance in 0..=coarsest {
                runs(stretches, stroke, graded).iter().for_each(|run| counting.run(run, tolerance));
            }
            for (stretch, _) in &stroke.stretches {
                if let Part::Strands(numbers) = &stretches.all[*stretch as usize].part {
                    numbers.iter().for_each(|&number| counting.strand(*stretch, &strands[number as usize], coarsest));
                }
            }
        }
        counting.outlays
    }
}

/// Edges of a stroke one after another of the same traits, above ground.
struct Run {
    traits: Traits,
    /// Nodes in order.
    nodes: Vec<u32>,
    /// The edge and the stretch between each two of them.
    edges: Vec<(u32, u32)>,
}

fn runs(stretches: &Stretches, stroke: &Stroke, graded: &Graded) -> Vec<Run> {
    let network = graded.network;
    let mut runs: Vec<Run> = Vec::new();
    for &(stretch, against) in &stroke.stretches {
        let Part::Way(nodes, edges) = &stretches.all[stretch as usize].part else { continue };
        for at in 0..edges.len() {
            let at = if against { edges.len() - 1 - at } else { at };
            let (from, to) = if against { (nodes[at + 1], nodes[at]) } else { (nodes[at], nodes[at + 1]) };
            let traits = *network.traits(edges[at]);
            if traits.storey.is_tunnel() {
                continue;
            }
            match runs.last_mut().filter(|run| run.traits == traits && run.nodes.last() == Some(&from)) {
                Some(run) => {
                    run.nodes.push(to);
                    run.edges.push((edges[at], stretch));
                }
                None => runs.push(Run { traits, nodes: vec![from, to], edges: vec![(edges[at], stretch)] }),
            }
        }
    }
    runs
}

struct Counting<'a> {
    outlays: Outlays,
    numbers: HashMap<Place, u32>,
    graded: &'a Graded<'a>,
    onto_decks: &'a BTreeSet<u32>,
    stays: &'a dyn Fn(Place) -> bool,
    shares: &'a Shares,
    site: &'a Site,
}

impl Counting<'_> {
    fn point(&mut self, place: Place) -> u32 {
        let points = &mut self.outlays.points;
        *self.numbers.entry(place).or_insert_with(|| {
            points.push(self.shares.of_place(place, self.site));
            points.len() as u32 - 1
        })
    }

    fn run(&mut self, run: &Run, tolerance: u8) {
        let Graded { network, heights, .. } = *self.graded;
        let count = run.nodes.len();
        let place = |at: usize| network.nodes[run.nodes[at] as usize].place;
        let station = |at: usize| {
            let node = run.nodes[at];
            let flat = |edge: Option<&(u32, u32)>| edge.map_or(0, |(edge, _)| network.flat_at(node, *edge));
            let flat = [flat(at.checked_sub(1).and_then(|before| run.edges.get(before))), flat(run.edges.get(at))];
            let stays = self.site.on_line(place(at)) || (self.stays)(place(at));
            Station { place: place(at), height: heights[node as usize], stays, flat }
        };
        let stations: Vec<Station> = (0..count).map(station).collect();
        let gives = |(ends, (edge, _)): (&[u32], &(u32, u32))| {
            let rise = (heights[ends[0] as usize] - heights[ends[1] as usize]).abs();
            network.edges[*edge as usize].rise_max < rise
        };
        let has_given = run.nodes.windows(2).zip(&run.edges).any(gives);
        let grade_ppm = if has_given { run.traits.grade_most_ppm() } else { run.traits.grade_ppm };
        let kept = thin(&stations, Tolerance::ALL[usize::from(tolerance)], grade_ppm, network.lattice);
        let mut needs = vec![false; count];
        kept.into_iter().for_each(|at| needs[at as usize] = true);
        let leads: Vec<bool> = run.edges.iter().map(|(edge, _)| self.onto_decks.contains(edge)).collect();
        (1..leads.len()).filter(|at| leads[*at - 1] != leads[*at]).for_each(|at| needs[at] = true);
        let is_mark = |at: &usize| needs[*at] || run.edges[*at - 1].1 != run.edges[*at].1;
        let marks: Vec<usize> = (0..count).filter(|at| *at == 0 || *at + 1 == count || is_mark(at)).collect();
        let is_deck = run.traits.storey.is_deck();
        let wide = !is_narrow(&run.traits, network)
            && matches!(run.traits.form, Form::Strip | Form::StripAlways | Form::Bench);
        let bench = wide && run.traits.form == Form::Bench;
        for ends in marks.windows(2) {
            let stretch = run.edges[ends[0]].1 as usize;
            if is_deck {
                let [a, b] = [place(ends[0]), place(ends[1])];
                if let Some(module) = self.shares.number(self.site.module_under(a, b)) {
                    // As many triangles at most as it has corners.
                    self.outlays.all[stretch][usize::from(tolerance)].decks.push((module, 4));
                }
                continue;
            }
            let strip_from = wide.then_some(if leads[ends[0]] { Way::ONTO_DECKS } else { Way::STRIP });
            for &at in ends {
                let point = self.point(place(at));
                let end = End { point, strip_from, bench, free: !needs[at] };
                self.outlays.all[stretch][usize::from(tolerance)].ends.push(end);
            }
        }
    }

    /// At every tolerance up to the coarsest; each station is looked up once.
    fn strand(&mut self, stretch: u32, strand: &Strand, coarsest: u8) {
        let stations = stations(strand, self.site, self.stays);
        let mut numbers = vec![None; stations.len()];
        for tolerance in 0..=usize::from(coarsest) {
            let kept = thin(&stations, Tolerance::ALL[tolerance], 0, self.site.lattice);
            let number = |at: &u32| {
                let at = *at as usize;
                *numbers[at].get_or_insert_with(|| self.point(stations[at].place))
            };
            let points: Vec<u32> = kept.iter().map(number).collect();
            let ends = &mut self.outlays.all[stretch as usize][tolerance].ends;
            for pair in points.windows(2) {
                ends.extend([pair[0], pair[1]].map(|point| End { point, strip_from: None, bench: false, free: false }));
            }
        }
    }
}
