//! What a click on a mesh of objects finds in a glTF: EXT_mesh_features says which object each vertex belongs to,
//! EXT_structural_metadata what each of them is.

use std::collections::BTreeMap;

use serde_json::{Value, json};
use terrain::{ObjectKind, metres_of_quanta};

use crate::mesh::Part;
use crate::objects::Thing;

/// The objects of a part.
#[derive(Clone, Debug, Default)]
pub(crate) struct FoundFeatures {
    /// Place of the object of each vertex among `things`.
    pub of_vertices: Vec<u32>,
    things: Vec<Thing>,
}

impl FoundFeatures {
    /// Those of a part of objects.
    pub(crate) fn of(part: &Part) -> Self {
        let mut found = Self { of_vertices: vec![0; part.vertices.len()], things: Vec::new() };
        let mut place_of = BTreeMap::new();
        for (thing, range) in &part.things {
            let place = *place_of.entry((thing.kind, thing.id)).or_insert_with(|| {
                found.things.push(*thing);
                found.things.len() as u32 - 1
            });
            for v in part.triangles[range.clone()].iter().flatten() {
                found.of_vertices[*v as usize] = place;
            }
        }
        found
    }

    /// What a primitive says of them.
    pub(crate) fn primitive(&self) -> Value {
        json!({ "EXT_mesh_features": { "featureIds": [
            { "featureCount": self.things.len(), "attribute": 0, "propertyTable": 0 },
        ] } })
    }

    /// What the document says of them; the numbers go behind all others.
    pub(crate) fn metadata(&self, views: &mut Vec<Value>, binary: &mut Vec<u8>) -> Value {
        let mut add = |bytes: Vec<u8>| {
            // Of the largest number that may stand there.
            binary.resize(binary.len().next_multiple_of(8), 0);
            views.push(json!({ "buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len() }));
            binary.extend(bytes);
            binary.resize(binary.len().next_multiple_of(8), 0);
            views.len() - 1
        };
        let ids = add(self.things.iter().flat_map(|thing| thing.id.to_le_bytes()).collect());
        let classes = add(self.things.iter().map(|thing| thing.kind as u8).collect());
        let heights = self.things.iter().map(|thing| metres_of_quanta(thing.height) as f32);
        let heights = add(heights.flat_map(f32::to_le_bytes).collect());
        let kind = |kind: ObjectKind| json!({ "name": kind.name(), "value": kind as u8 });
        json!({
            "schema": {
                "id": "tiefort",
                "classes": { "object": { "properties": {
                    "id": { "type": "SCALAR", "componentType": "UINT64", "required": true },
                    "class": { "type": "ENUM", "enumType": "kind", "required": true },
                    "height_m": { "type": "SCALAR", "componentType": "FLOAT32", "required": true },
                } } },
                "enums": { "kind": { "valueType": "UINT8", "values": ObjectKind::ALL.map(kind) } },
            },
            "propertyTables": [{
                "class": "object",
                "count": self.things.len(),
                "properties": {
                    "id": { "values": ids }, "class": { "values": classes }, "height_m": { "values": heights },
                },
            }],
        })
    }
}
