//! What there is no room for still shapes the ground: roads lie flat across, lakes level, between banks water falls.

use crate::choice::{Choice, Chosen, Why};
use crate::forms::{Formed, Surface};
use crate::pieces::pieces;
use crate::room::Sharing;
use crate::strand::{Role, Strand};
use crate::stretches::Part;
use crate::{Form, Grant, Grants};

/// Puts the ground of what is left out into what is formed.
pub(crate) fn shape(choice: &Choice, chosen: &Chosen, strands: &[Strand], formed: &mut Formed) {
    let is_out = |way: &Result<_, Why>| way.as_ref().is_err_and(|why: &Why| *why != Why::Beyond);
    let network = choice.graded.network;
    let mut edges = vec![Grant::OUT; network.edges.len()];
    for (of, _) in choice.stretches.all.iter().zip(&chosen.ways).filter(|(_, way)| is_out(way)) {
        match &of.part {
            Part::Way(_, all) => all.iter().for_each(|edge| {
                edges[*edge as usize] = Grant { tolerance: 0, most: Form::StripAlways, out: false };
            }),
            Part::Strands(numbers) => {
                let outlines = numbers.iter().map(|number| &strands[*number as usize]);
                formed.shaped.extend(outlines.filter(|strand| strand.role.is_outline()).map(|strand| Surface {
                    class: strand.class,
                    role: strand.role,
                    ring: strand.stations[1..].to_vec(),
                    id: strand.id,
                }));
            }
        }
    }
    let grants = Grants { edges, strands: Vec::new() };
    let pieces = pieces(network, choice.graded.heights, choice.site, &|_| false, &grants);
    let strips = Sharing::of(network, &pieces, choice.graded.heights).faces();
    for face in strips.into_iter().filter(|face| !face.is_deck && 3 <= face.corners.len()) {
        if face.corners.len() == 4 && face.wide.is_some() {
            let [right_a, right_b, left_b, left_a] = [0, 1, 2, 3].map(|corner| face.corners[corner]);
            formed.shaped_slopes.extend([[right_a, right_b], [left_a, left_b]]);
        }
        let (class, id) = (face.class, face.id);
        formed.shaped.push(Surface { class, role: Role::Side, ring: face.corners, id });
    }
    for piece in pieces.iter().filter(|piece| !piece.is_deck()) {
        for (ends, _) in piece.nodes.windows(2).zip(&piece.strips).filter(|(_, is_strip)| !**is_strip) {
            let station = |node: u32| (network.nodes[node as usize].place, choice.graded.heights[node as usize]);
            formed.shaped_slopes.push([station(ends[0]), station(ends[1])]);
        }
    }
    formed.shaped.sort();
    formed.shaped_slopes.sort_unstable();
}
